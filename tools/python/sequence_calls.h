// postchain.run_sequence(), plan_sequence(), inspect(), check() and sheet(): the subcommands of
// these names.
#pragma once

#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <memory>
#include <set>
#include <string>
#include <vector>

#include "tools/python/chain_object.h"
#include "tools/python/device.h"
#include "tools/python/errors.h"
#include "tools/sequence/files/output_files.h"

namespace postchain::python {

// The ways to end a call early.
struct Callbacks {
    pybind11::object progress;  // called with a dict; False ends the call; None
    pybind11::object stop;      // an object with is_set(), as threading.Event; None

    // Raises UsageError for objects of other kinds.
    void check() const;
    // For Call::wait(): ends the call, and sets `stopped`, if `stop` is set.
    Call::Idle watch(bool& stopped) const;
    // True: the callback returned False.
    bool ended_by(const pybind11::dict& report) const;
};

// The value of a call. Raises its error, and CanceledError if callbacks ended it.
template <class T>
T value_unless_stopped(Result<T> result, bool stopped) {
    if (!result.ok()) raise(result.status());
    if (stopped) raise(Status(StatusCode::canceled, "stopped"));
    return std::move(*result);
}

// The summary as a dict. Raises the first failure unless on_error is "continue".
pybind11::dict run_sequence(const ChainObject& chain, const std::string& input,
                            const std::string& output, const pybind11::object& camera,
                            const Callbacks& callbacks, const std::shared_ptr<Device>& device,
                            const pybind11::kwargs& settings);

// A dict for each frame, as `plan --json` prints it, with `warnings`. Raises the first
// frame's failure.
pybind11::list plan_sequence(const ChainObject& chain, const std::string& input,
                             const pybind11::object& camera, const pybind11::kwargs& settings);

// For frames(): the numbers of the frames that are wanted, of those on disk, and of those that a
// cut follows. `settings`: frames, and keys of read_keys(). Raises if a wanted frame is not on
// disk.
pybind11::tuple frame_list(const std::string& input, const pybind11::kwargs& settings);

// As `inspect --json`: of a folder {"folder", "sequences"}, of frames {"frames": [...],
// "sequence"}.
pybind11::object inspect(const std::string& input, const pybind11::object& camera,
                         const pybind11::kwargs& settings);

const std::set<std::string>& sheet_keys();  // of the job's rows
// The value of an argument `on_existing`.
io::OnExisting on_existing_of(const pybind11::object& given, const char* function);

// As `check --json`.
pybind11::dict check(const std::vector<std::string>& outputs, const pybind11::object& frames,
                     const std::string& like);

// {"frames", "of", "absent"}.
pybind11::dict sheet(const std::string& input, const std::string& output, const std::string& beside,
                     int cells, int columns, int width, const pybind11::object& on_existing,
                     const Callbacks& callbacks, const pybind11::kwargs& values);

}  // namespace postchain::python
