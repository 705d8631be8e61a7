// The chain that a user edits, with undo and redo. No pixels, no window.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "chain/chain.h"

namespace postchain::view {

// One state of the list of undo.
struct DocumentState {
    Chain chain;                       // also passes that are switched off
    std::vector<bool> off;             // by link
    std::vector<int> entry;            // by link: index in the file's list of passes; -1: added
    std::map<int, double> focus_keys;  // by frame: focus distance, scene units

    DocumentState clone() const;
};

class Document {
  public:
    explicit Document(const PassRegistry& registry, Chain chain = {});

    const DocumentState& state() const { return *states_[at_]; }
    const Chain& chain() const { return state().chain; }
    const PassRegistry& registry() const { return registry_; }
    // Grows with every change, also by undo and redo.
    uint64_t revision() const { return revision_; }

    // The chain that filters a frame: without passes that are off, with the keys' focus.
    Chain chain_at(int frame) const;
    // The chain that a file gets: without passes that are off and, if there are keys, without a
    // focus distance.
    Chain chain_to_save() const;

    // Edits. A change to the value that is set already is no edit. Errors (chain): unknown pass or
    // key, a value out of range; the document is then unchanged.
    Status set(size_t link, std::string_view key, const ParameterValue& value);
    // Sets the key in every pass that has it and reads it.
    Status set_in_all(std::string_view key, const ParameterValue& value);
    // Sets the chain's camera, and unsets the passes' own values of this name.
    Status set_camera(std::string_view key, const ParameterValue& value);
    Status add(std::string_view type, size_t position);
    Status erase(size_t link);
    Status move(size_t from, size_t to);
    // `order`: every index once.
    Status reorder(const std::vector<size_t>& order);
    Status switch_off(size_t link, bool off);
    // Another chain in place of this one; `entries`: its passes are those of the file, in order.
    void replace(Chain chain, const std::string& name, bool entries);
    // The passes of another chain; the camera stays.
    void take_passes(const Chain& chain, const std::string& name);
    // Errors (chain): not a distance above 0.
    Status set_focus_key(int frame, double distance);
    void remove_focus_key(int frame);

    // Edits between the two are undone together: those of one drag.
    void begin_gesture();
    void end_gesture();
    bool in_gesture() const { return gesture_; }

    bool can_undo() const { return at_ > 0; }
    bool can_redo() const { return at_ + 1 < states_.size(); }
    std::string undo_name() const { return can_undo() ? names_[at_] : ""; }
    std::string redo_name() const { return can_redo() ? names_[at_ + 1] : ""; }
    void undo();
    void redo();

    bool changed() const { return saved_ != states_[at_]; }
    // The current state is in the file now. `entries`: in the file's list of passes each link that
    // is on has the index of its place among these.
    void saved(bool entries);

  private:
    void push(DocumentState state, const std::string& name);
    bool same(const DocumentState& a, const DocumentState& b) const;

    const PassRegistry& registry_;
    std::vector<std::shared_ptr<const DocumentState>> states_;
    std::vector<std::string> names_;  // of the edit that led to the state
    size_t at_ = 0;
    std::shared_ptr<const DocumentState> saved_;
    bool gesture_ = false;
    bool gesture_pushed_ = false;
    uint64_t revision_ = 1;
};

// The focus distance at a frame between keys: linear in 1/distance; outside, that of the nearest
// key. Precondition: not empty.
double focus_at(const std::map<int, double>& keys, int frame);

}  // namespace postchain::view
