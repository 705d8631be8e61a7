// The files that a reply shows: sidecars, images, reports, outputs.
#pragma once

#include <string>
#include <vector>

#include "tools/service/store/job_store.h"
#include "tools/service/work/job_request.h"
#include "tools/service/work/service.h"

namespace postchain::service {

// The sidecar beside an output, if the roots have it; empty = none.
std::string sidecar_of(const std::string& output, const Roots& roots);

// A frame's file before or after filtering, and how to read it.
struct ShownFrame {
    std::string path;
    int frame = 0;
    std::vector<std::string> words = {};  // options of its job; none = of no job
};
Answer<ShownFrame> shown_frame(const Job& job, const JobFrame& frame, bool after,
                               const JobReader& reader);
// The frame that represents a job in a list: its last finished one after filtering, otherwise its
// first one before.
Answer<ShownFrame> shown_frame(const Job& job, const std::vector<JobFrame>& frames,
                               const JobReader& reader);
// A frame of an input, as a request names it.
Answer<ShownFrame> input_frame(const std::string& input, int frame, const Roots& roots);

// An image of it by postchain-preview, in a process of its own (tools/service/preview): a decoder
// that a file crashes, or that takes too much memory or time, costs that request alone.
//
//   its stdin:  a line of JSON {"folders", "words", "path", "frame", "memory", "type", "side"}
//   its stdout: the image, or with exit code 1 {"code", "message"}
//
// `memory`: bytes of its frame. Errors: those of reading; (input): the process died, or took too
// long.
inline constexpr const char* kImageWord = "image";
Result<std::string> image_of(const std::string& program, const ShownFrame& shown,
                             const Roots& roots, const PictureWanted& wanted, uint64_t memory);

// The error in {"code", "message"}, as postchain-preview writes it.
Status status_of_json(const std::string& text);

Answer<ResultFile> report_file_of(const Job& job, const std::string& name, const JobReader& reader);

// The output of a finished frame. Problems: not_found, if there is none.
Answer<ResultFile> output_of(const JobFrame& frame, const Roots& roots);

// Bytes on disk of what a job's NewJob::writes names: the frames of patterns, with the files that
// are named after them, and all files in folders.
int64_t bytes_on_disk(const std::string& writes);
// Whether outputs of removed jobs that count for the user are no longer on disk.
Result<bool> settle(JobStore& store, const User& user);
// Errors (output): a job's owner has written more than max_disk, and no output was deleted. Null:
// no limit.
Status check_disk(JobStore& store, const KnownUser& owner);

}  // namespace postchain::service
