#include "tools/service/store/job_frames.h"

#include "tools/service/store/rows.h"
#include "tools/service/store/upkeep.h"

namespace postchain::service {

Result<std::vector<JobFrame>> JobFrames::frames(const std::string& id) const {
    return look([&](Database& database) {
        return all(
            Statement(database, concat(kFrame, "WHERE job = ? ORDER BY place"), number_of(id)),
            frame_of);
    });
}

Result<std::optional<JobFrame>> JobFrames::frame(const std::string& id, int frame) const {
    return look([&](Database& database) {
        return first(Statement(database, concat(kFrame, "WHERE job = ? AND frame = ?"),
                               number_of(id), frame),
                     frame_of);
    });
}

Result<FrameTally> JobFrames::tally(const std::string& id) const {
    return look([&](Database& database) {
        FrameTally tally;
        Statement found(database,
                        "SELECT frame, state, held FROM frames WHERE job = ? AND (state NOT IN "
                        "('written', 'skipped') OR held = 1) ORDER BY place",
                        number_of(id));
        while (found.step()) {
            const std::string state = found.text(1);
            if (state == "waiting") ++tally.waiting;
            if (state == "missing") ++tally.missing;
            if (state == "quarantined") tally.quarantined.push_back(int(found.integer(0)));
            if (found.integer(2) != 0) ++tally.held;
        }
        return tally;
    });
}

Result<std::vector<FrameToDo>> JobFrames::to_do(const std::string& id) const {
    return look([&](Database& database) {
        return all(Statement(database,
                             "SELECT frame, attempts, begun, alone FROM frames WHERE job = ? AND "
                             "state = 'waiting' ORDER BY place",
                             number_of(id)),
                   [](const Statement& row) {
                       return FrameToDo{int(row.integer(0)), int(row.integer(1)),
                                        row.integer(2) != 0, row.integer(3) != 0};
                   });
    });
}

Status JobFrames::enter_frames(const std::string& id, const std::vector<JobFrame>& frames) {
    return change([&](Database& database) {
        const int64_t job = number_of(id);
        int64_t place = 0;
        for (const JobFrame& frame : frames) {
            database.run(
                "INSERT OR IGNORE INTO frames(job, place, frame, state, output, message) "
                "VALUES(?, ?, ?, ?, ?, ?)",
                job, place++, frame.frame, name_of(frame.state), frame.output, frame.message);
            if (frame.state == FrameState::quarantined)
                add_event(job, "quarantined",
                          {{"frame", frame.frame}, {"attempts", 0}, {"message", frame.message}});
        }
        database.run("UPDATE jobs SET begun = 1 WHERE id = ?", job);
        count_frames(database, job);
        add_event(job, "frames", {{"frames", frames.size()}});
    });
}

Status JobFrames::frame_begins(const std::string& id, int frame) {
    return change([&](Database& database) {
        database.run(
            "UPDATE frames SET attempts = attempts + 1, begun = 1, in_flight = 1 WHERE job = ? AND "
            "frame = ? AND state = 'waiting'",
            number_of(id), frame);
    });
}

Status JobFrames::frame_ends(const std::string& id, const FrameEnd& end) {
    return change([&](Database& database) {
        const int64_t job = number_of(id);
        if (database.run("UPDATE frames SET state = ?, in_flight = 0, alone = 0, held = ?, message "
                         "= ?, filter_ms = ? WHERE job = ? AND frame = ? AND state = 'waiting'",
                         name_of(end.state), int(end.held), end.message, end.filter_ms, job,
                         end.frame) == 0)
            return;
        const bool good = end.state == FrameState::written || end.state == FrameState::skipped;
        database.run(
            "UPDATE jobs SET attempts = 0, done = done + ?, failed = failed + ?, bytes = bytes + ? "
            "WHERE id = ?",
            int(good), int(!good), end.bytes, job);
        io::Json data = {{"frame", end.frame}, {"state", name_of(end.state)}};
        if (!end.message.empty()) data["message"] = end.message;
        if (end.state == FrameState::written) data["filter_ms"] = end.filter_ms;
        Statement counts(database, "SELECT frames, done, failed FROM jobs WHERE id = ?", job);
        counts.step();
        data["frames"] = counts.integer(0);
        data["done"] = counts.integer(1);
        data["failed"] = counts.integer(2);
        add_event(job, "frame", data);
    });
}

Status JobFrames::frame_fails(const std::string& id, int frame, const std::string& message) {
    return change([&](Database& database) {
        const int64_t job = number_of(id);
        if (database.run("UPDATE frames SET in_flight = 0, message = ?, state = CASE WHEN attempts "
                         ">= ? THEN 'quarantined' ELSE 'waiting' END WHERE job = ? AND frame = ? "
                         "AND state = 'waiting'",
                         message, attempts_, job, frame) == 0)
            return;
        Statement now(database, "SELECT state, attempts FROM frames WHERE job = ? AND frame = ?",
                      job, frame);
        now.step();
        const bool quarantined = now.text(0) == "quarantined";
        database.run("UPDATE jobs SET attempts = 0, failed = failed + ? WHERE id = ?",
                     int(quarantined), job);
        add_event(job, quarantined ? "quarantined" : "frame_failed",
                  {{"frame", frame}, {"attempts", now.integer(1)}, {"message", message}});
    });
}

Status JobFrames::release(const std::string& id) {
    return change([&](Database& database) {
        database.run(
            "UPDATE frames SET attempts = MAX(attempts - 1, 0), in_flight = 0 WHERE job = ? AND "
            "in_flight = 1",
            number_of(id));
    });
}

}  // namespace postchain::service
