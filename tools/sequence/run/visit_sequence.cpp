#include "tools/sequence/run/visit_sequence.h"

#include "tools/sequence/run/runner.h"

namespace postchain::sequence {
namespace {

class VisitJob final : public FrameJob {
  public:
    VisitJob(RoleSet wanted, const FrameVisitor& visitor) : wanted_(wanted), visitor_(visitor) {}

    io::Keep keep() const override { return io::Keep::nothing; }
    RoleSet planes(const FrameHeader&) const override { return wanted_; }
    Result<bool> begin(const FrameTask&, const FrameInputs&, FrameReport&) override { return true; }
    Status prepare(const SourceFrame&, FrameReport&) override { return Status(); }
    Status process(FrameInFlight& frame, const Upcoming&) override {
        return visitor_(*frame.source, frame.report);
    }
    Status write(FrameInFlight&) override { return Status(); }

  private:
    RoleSet wanted_;
    const FrameVisitor& visitor_;
};

}  // namespace

Result<RunSummary> visit_sequence(const RunSettings& settings, RoleSet wanted,
                                  const FrameVisitor& visitor, const FrameObserver& observer,
                                  const std::atomic<bool>* stop) {
    std::vector<int> gaps;
    ASSIGN_OR_RETURN(auto tasks, plan_tasks(settings, false, gaps));
    ListFeed feed(std::move(tasks), settings);
    VisitJob job(wanted, visitor);
    auto summary = walk_sequence(job, settings, feed, observer, stop);
    if (summary.ok()) summary->gaps = std::move(gaps);
    return summary;
}

}  // namespace postchain::sequence
