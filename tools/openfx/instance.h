// An effect in a host's graph: answers its actions. Messages on the node go when their cause goes.
#pragma once

#include <mutex>
#include <string>

#include "chain/frame/sign_check.h"
#include "tools/openfx/node.h"

namespace postchain::openfx {

class Instance {
  public:
    Instance(const EffectType& type, Effect effect) : type_(&type), effect_(effect) {}

    // Main thread.
    void created();
    void changed(Properties in);
    HostStatus clip_preferences(Properties out);
    // Any thread.
    HostStatus region_of_definition(Properties in, Properties out);
    HostStatus regions_of_interest(Properties in, Properties out);
    HostStatus frames_needed(Properties in, Properties out);
    HostStatus is_identity(Properties in, Properties out);
    HostStatus render(Properties in);
    // Shows the error of an action, or that there is none, and returns the host's status.
    HostStatus conclude(const Status& status);

  private:
    Result<Node> node_at(Properties in);
    Result<Node> node_at(const Moment& moment) {
        return Node::read(*type_, effect_, moment, files_);
    }
    Status render_frame(Properties in);
    Result<ImageF> filter(const Node& node, const Node::Frame& frame);
    // Compares signs once for each meaning of the vectors, if the next frame is known.
    void check_signs_once(const Node& node, const Node::Frame& frame);
    Status check(double time);
    void refresh(double time);
    void set_status(const std::string& text);
    void show(const char* type, const std::string& text);

    const EffectType* type_;
    Effect effect_;
    CameraFiles files_;
    std::mutex mutex_;
    std::string shown_;    // the persistent message, with its type
    std::string warning_;  // of the sign check
    std::string signs_;    // what it found, for the status
    std::string checked_;  // the conventions that it was made with
    std::string report_;   // for the status
};

}  // namespace postchain::openfx
