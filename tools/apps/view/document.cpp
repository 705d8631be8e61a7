#include "tools/apps/view/document.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numeric>
#include <optional>
#include <set>

#include "config/chain_file.h"
#include "tools/sequence/image/bokeh_kernel_file.h"

namespace postchain::view {
namespace {

constexpr size_t kMaxStates = 500;
constexpr size_t kMaxOrders = 4;  // passes whose every order is listed: 24 of them

Status no_pass(size_t link) {
    return Status(StatusCode::chain, concat("the chain has no pass ", link));
}

// Whether a pass's row states the camera's value `key`: by its name, or in another way, as a place
// in focus states the distance and an angle the shutter.
bool states(const Parameter& row, std::string_view key) {
    return row.optional && (row.key == key || row.excludes == key);
}

void unset_in_passes(Chain& chain, std::string_view key) {
    for (ChainLink& link : chain.links)
        for (const Parameter& row : link.type->parameters->rows())
            if (states(row, key)) row.set(link.pass->parameters(), ParameterValue());
}

}  // namespace

DocumentState DocumentState::clone() const {
    return {chain.clone(), off, id, focus_keys};
}

std::string OffPass::lines() const {
    std::string text = above;
    for (size_t at = 0; at < body.size();) {
        const size_t end = std::min(body.find('\n', at), body.size() - 1) + 1;
        text += "# " + body.substr(at, end - at);
        at = end;
    }
    return text;
}

double focus_at(const std::map<int, double>& keys, int frame) {
    const auto after = keys.lower_bound(frame);
    if (after == keys.end()) return std::prev(after)->second;
    if (after == keys.begin() || after->first == frame) return after->second;
    const auto before = std::prev(after);
    const double t = double(frame - before->first) / double(after->first - before->first);
    return 1 / ((1 - t) / before->second + t / after->second);
}

Document::Document(const PassRegistry& registry, Chain chain) : registry_(registry) {
    DocumentState state;
    state.off.assign(chain.links.size(), false);
    for (size_t i = 0; i < chain.links.size(); ++i) state.id.push_back(next_id_++);
    state.chain = std::move(chain);
    states_.push_back(std::make_shared<const DocumentState>(std::move(state)));
    names_.push_back("");
    saved();
}

bool Document::same(const DocumentState& a, const DocumentState& b) const {
    return a.off == b.off && a.focus_keys == b.focus_keys &&
           write_chain(a.chain) == write_chain(b.chain) && a.chain.text() == b.chain.text();
}

void Document::push(DocumentState state, const std::string& name) {
    if (same(state, *states_[at_])) return;
    states_.resize(at_ + 1);
    names_.resize(at_ + 1);
    if (gesture_ && gesture_pushed_) {
        states_.pop_back();
        names_.pop_back();
    }
    states_.push_back(std::make_shared<const DocumentState>(std::move(state)));
    names_.push_back(name);
    if (states_.size() > kMaxStates) {
        states_.erase(states_.begin());
        names_.erase(names_.begin());
    }
    at_ = states_.size() - 1;
    gesture_pushed_ = gesture_;
    ++revision_;
}

void Document::begin_gesture() {
    if (!gesture_) gesture_pushed_ = false;
    gesture_ = true;
}

void Document::end_gesture() {
    gesture_ = gesture_pushed_ = false;
}

void Document::undo() {
    if (!can_undo()) return;
    end_gesture();
    --at_;
    ++revision_;
}

void Document::redo() {
    if (!can_redo()) return;
    end_gesture();
    ++at_;
    ++revision_;
}

void Document::saved(std::map<uint64_t, OffPass> off) {
    in_file_.clear();
    for (size_t i = 0; i < state().id.size(); ++i)
        if (!state().off[i]) in_file_.emplace(state().id[i], int(in_file_.size()));
    off_in_file_ = std::move(off);
    saved_ = states_[at_];
    end_gesture();
}

int Document::entry(size_t link) const {
    const auto found = in_file_.find(state().id[link]);
    return found == in_file_.end() ? -1 : found->second;
}

bool Document::keys_changed() const {
    return !state().focus_keys.empty() && state().focus_keys != saved_keys_;
}

Chain Document::chain_at(int frame) const {
    Chain chain = chain_to_save();
    chain.camera = camera_at(frame);
    return chain;
}

uint64_t Document::hash_at(int frame) const {
    if (std::exchange(hashed_revision_, revision_) != revision_) hashes_.clear();
    // Without keys each frame has the same chain.
    const int by = state().focus_keys.empty() ? 0 : frame;
    const auto found = hashes_.find(by);
    if (found != hashes_.end()) return found->second;
    const Chain chain = chain_at(frame);
    return hashes_[by] = hash_text(chain.text(), hash_text(write_chain(chain)));
}

Camera Document::camera_at(int frame) const {
    Camera camera = chain().camera;
    if (!state().focus_keys.empty()) camera.focus_distance = focus_at(state().focus_keys, frame);
    return camera;
}

Chain Document::chain_to_save() const {
    Chain chain = state().chain.clone();
    for (size_t i = chain.links.size(); i-- > 0;)
        if (state().off[i]) chain.links.erase(chain.links.begin() + std::ptrdiff_t(i));
    if (!state().focus_keys.empty()) chain.camera.focus_distance.reset();
    return chain;
}

Status Document::set(size_t link, std::string_view key, const ParameterValue& value) {
    if (link >= chain().links.size()) return no_pass(link);
    DocumentState next = state().clone();
    ChainLink& one = next.chain.links[link];
    if (link_parameters().find(key)) {
        RETURN_IF_ERROR(link_parameters().set(&one, key, value));
        RETURN_IF_ERROR(one.check_matte());
    } else {
        const ParameterTable& table = *one.type->parameters;
        RETURN_IF_ERROR(table.set(one.pass->parameters(), key, value));
        RETURN_IF_ERROR(table.check(one.pass->parameters()));
    }
    push(std::move(next), concat(one.type->name, ".", key));
    return Status();
}

Status Document::set_in_all(std::string_view key, const ParameterValue& value) {
    DocumentState next = state().clone();
    for (ChainLink& link : next.chain.links) {
        const ParameterTable& table = *link.type->parameters;
        const Parameter* row = table.find(key);
        if (!row || !table.unread(*row, link.pass->parameters()).empty()) continue;
        RETURN_IF_ERROR(table.set(link.pass->parameters(), key, value));
    }
    push(std::move(next), std::string(key));
    return Status();
}

Status Document::set_camera(std::string_view key, const ParameterValue& value) {
    DocumentState next = state().clone();
    RETURN_IF_ERROR(camera_parameters().set(&next.chain.camera, key, value));
    RETURN_IF_ERROR(camera_parameters().check(&next.chain.camera));
    if (key == "aperture_image") {
        io::ApertureFiles pictures;
        RETURN_IF_ERROR(pictures.read(next.chain.camera));
    }
    unset_in_passes(next.chain, key);
    if (key == "focus_distance") next.focus_keys.clear();
    push(std::move(next), concat("camera.", key));
    return Status();
}

Status Document::add(std::string_view type, size_t position) {
    DocumentState next = state().clone();
    if (next.chain.links.size() >= kMaxPasses)
        return Status(StatusCode::chain, concat("a chain has at most ", kMaxPasses, " passes"));
    if (!next.chain.append(registry_, type))
        return Status(StatusCode::chain, concat("unknown pass '", type, "'"));
    next.off.push_back(false);
    next.id.push_back(next_id_++);
    position = std::min(position, next.off.size() - 1);
    std::rotate(next.chain.links.begin() + std::ptrdiff_t(position), next.chain.links.end() - 1,
                next.chain.links.end());
    std::rotate(next.off.begin() + std::ptrdiff_t(position), next.off.end() - 1, next.off.end());
    std::rotate(next.id.begin() + std::ptrdiff_t(position), next.id.end() - 1, next.id.end());
    push(std::move(next), concat("add ", type));
    return Status();
}

Status Document::erase(size_t link) {
    if (link >= chain().links.size()) return no_pass(link);
    DocumentState next = state().clone();
    const std::string name = next.chain.links[link].type->name;
    next.chain.links.erase(next.chain.links.begin() + std::ptrdiff_t(link));
    next.off.erase(next.off.begin() + std::ptrdiff_t(link));
    next.id.erase(next.id.begin() + std::ptrdiff_t(link));
    push(std::move(next), "remove " + name);
    return Status();
}

Status Document::move(size_t from, size_t to) {
    if (from >= chain().links.size()) return no_pass(from);
    std::vector<size_t> order(chain().links.size());
    std::iota(order.begin(), order.end(), size_t(0));
    order.erase(order.begin() + std::ptrdiff_t(from));
    order.insert(order.begin() + std::ptrdiff_t(std::min(to, order.size())), from);
    return reorder(order);
}

Status Document::reorder(const std::vector<size_t>& order) {
    const DocumentState& now = state();
    std::vector<size_t> sorted = order;
    std::sort(sorted.begin(), sorted.end());
    for (size_t i = 0; i < sorted.size(); ++i)
        if (sorted[i] != i || sorted.size() != now.off.size()) return no_pass(sorted[i]);
    DocumentState next;
    next.chain.camera = now.chain.camera;
    next.focus_keys = now.focus_keys;
    for (const size_t i : order) {
        next.chain.links.push_back(now.chain.links[i].clone());
        next.off.push_back(now.off[i]);
        next.id.push_back(now.id[i]);
    }
    push(std::move(next), "order");
    return Status();
}

std::vector<std::string> Document::passes_with_own(std::string_view key) const {
    std::vector<std::string> names;
    for (size_t i = 0; i < chain().links.size(); ++i) {
        const ChainLink& link = chain().links[i];
        const auto& rows = link.type->parameters->rows();
        if (!state().off[i] && std::any_of(rows.begin(), rows.end(), [&](const Parameter& row) {
                return states(row, key) && row.get(link.pass->parameters()) != ParameterValue();
            }))
            names.push_back(link.type->name);
    }
    return names;
}

std::string Document::name_of_order(const std::vector<size_t>& order) const {
    std::string text;
    for (const size_t i : order) text += (text.empty() ? "" : " > ") + chain().links[i].type->name;
    return text;
}

std::vector<std::vector<size_t>> Document::orders() const {
    std::vector<std::vector<size_t>> found;
    std::vector<size_t> order(chain().links.size());
    if (order.empty() || order.size() > kMaxOrders) return found;
    std::iota(order.begin(), order.end(), size_t(0));
    std::set<std::string> names;
    do {
        if (names.insert(name_of_order(order)).second) found.push_back(order);
    } while (std::next_permutation(order.begin(), order.end()));
    return found;
}

Status Document::switch_off(size_t link, bool off) {
    if (link >= chain().links.size()) return no_pass(link);
    DocumentState next = state().clone();
    next.off[link] = off;
    push(std::move(next), concat(next.chain.links[link].type->name, off ? " off" : " on"));
    return Status();
}

void Document::replace(Chain chain, const std::string& name) {
    DocumentState next;
    next.off.assign(chain.links.size(), false);
    for (size_t i = 0; i < chain.links.size(); ++i) next.id.push_back(next_id_++);
    next.focus_keys = state().focus_keys;
    next.chain = std::move(chain);
    push(std::move(next), name);
}

void Document::restore(DocumentState state) {
    std::vector<bool> taken(this->state().id.size(), false);
    state.id.clear();
    for (const ChainLink& link : state.chain.links) {
        uint64_t id = next_id_;
        for (size_t i = 0; i < taken.size(); ++i) {
            if (taken[i] || chain().links[i].type != link.type) continue;
            taken[i] = true;
            id = this->state().id[i];
            break;
        }
        if (id == next_id_) ++next_id_;
        state.id.push_back(id);
    }
    push(std::move(state), "restore");
}

void Document::take_passes(const Chain& chain, const std::string& name) {
    Chain next = chain.clone();
    next.camera = state().chain.camera;
    replace(std::move(next), name);
}

Status Document::set_focus_key(int frame, double distance) {
    if (!std::isfinite(distance) || distance <= 0)
        return Status(StatusCode::chain,
                      concat("focus_distance: ", distance, " is not a distance above 0"));
    DocumentState next = state().clone();
    next.focus_keys[frame] = distance;
    unset_in_passes(next.chain, "focus_distance");
    push(std::move(next), concat("focus key ", frame));
    return Status();
}

void Document::remove_focus_key(int frame) {
    DocumentState next = state().clone();
    next.focus_keys.erase(frame);
    push(std::move(next), concat("remove focus key ", frame));
}

}  // namespace postchain::view
