// The chain that a user edits, with undo and redo. No pixels, no window.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "chain/pass/chain.h"

namespace postchain::view {

// One state of the list of undo.
struct DocumentState {
    Chain chain;                       // also passes that are switched off
    std::vector<bool> off;             // by link
    std::vector<uint64_t> id;          // by link: stays the same through edits, undo and redo
    std::map<int, double> focus_keys;  // by frame: focus distance, scene units

    DocumentState clone() const;
};

// A pass that is switched off, as the file has it: in comments.
struct OffPass {
    std::string above;  // lines of comments that belong to it
    std::string body;   // its lines without the mark of a comment
    std::string link;   // ChainLink::text() then

    // The lines of the file.
    std::string lines() const;
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
    // Hash of the chain that filters a frame.
    uint64_t hash_at(int frame) const;
    // Its camera alone.
    Camera camera_at(int frame) const;
    // The chain that a file gets: without passes that are off and, if there are keys, without a
    // focus distance.
    Chain chain_to_save() const;

    // Edits. A change to the value that is set already is no edit. Errors (chain): unknown pass or
    // key, a value out of range; the document is then unchanged.
    Status set(size_t link, std::string_view key, const ParameterValue& value);
    // Sets the key in every pass that has it and reads it.
    Status set_in_all(std::string_view key, const ParameterValue& value);
    // Sets the chain's camera, and unsets the passes' own values of this name. One that excludes
    // it, as the shutter's angle excludes its time, is unset too.
    Status set_camera(std::string_view key, const ParameterValue& value);
    Status add(std::string_view type, size_t position);
    Status erase(size_t link);
    Status move(size_t from, size_t to);
    // `order`: every index once.
    Status reorder(const std::vector<size_t>& order);
    // The orders of the passes that differ by their names, the current one first; none if there are
    // no passes, or too many to list.
    std::vector<std::vector<size_t>> orders() const;
    // The passes that are on and state this value of the camera themselves.
    std::vector<std::string> passes_with_own(std::string_view key) const;
    std::string name_of_order(const std::vector<size_t>& order) const;
    Status switch_off(size_t link, bool off);
    // Another chain in place of this one.
    void replace(Chain chain, const std::string& name);
    // Edits of an earlier session. Passes that this chain has too keep their places in its file.
    void restore(DocumentState state);
    // The passes of another chain; the camera stays.
    void take_passes(const Chain& chain, const std::string& name);
    // Unsets the passes' own focus. Errors (chain): not a distance above 0.
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
    // The current state is in the file now: its links that are on, in order, and in comments those
    // that are off, by id.
    void saved(std::map<uint64_t, OffPass> off = {});
    // Index in the file's list of passes, in whatever state; -1: the file does not have it.
    int entry(size_t link) const;
    const std::map<uint64_t, OffPass>& off_in_file() const { return off_in_file_; }

    // There are focus keys, and they are in no camera file.
    bool keys_changed() const;
    bool unsaved() const { return changed() || keys_changed(); }
    void keys_saved() { saved_keys_ = state().focus_keys; }

  private:
    void push(DocumentState state, const std::string& name);
    bool same(const DocumentState& a, const DocumentState& b) const;

    const PassRegistry& registry_;
    std::vector<std::shared_ptr<const DocumentState>> states_;
    std::vector<std::string> names_;  // of the edit that led to the state
    size_t at_ = 0;
    std::shared_ptr<const DocumentState> saved_;
    std::map<int, double> saved_keys_;
    uint64_t next_id_ = 0;
    std::map<uint64_t, int> in_file_;  // index in the file's list of passes, by id
    std::map<uint64_t, OffPass> off_in_file_;
    bool gesture_ = false;
    bool gesture_pushed_ = false;
    uint64_t revision_ = 1;
    mutable std::map<int, uint64_t> hashes_;  // hash_at(), at `hashed_revision_`
    mutable uint64_t hashed_revision_ = 0;
};

// The focus distance at a frame between keys: linear in 1/distance; outside, that of the nearest
// key. Precondition: not empty.
double focus_at(const std::map<int, double>& keys, int frame);

}  // namespace postchain::view
