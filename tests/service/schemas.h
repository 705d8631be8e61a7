// Schemas of a program that a test makes up, as `KIND --schema` prints them.
#pragma once

namespace postchain::test {

inline constexpr const char* kRunSchema =
    R"({"required": ["chain", "input", "output"], "properties": {
    "chain": {"type": "string"},
    "set": {"type": "array", "items": {"type": "string"}},
    "input": {"type": "string", "x-path": "input"},
    "behind": {"type": ["string", "null"], "x-path": "pattern"},
    "output": {"type": "string", "x-path": "output"},
    "frames": {"type": ["string", "null"]},
    "camera": {"type": ["string", "null"], "x-path": "file"},
    "profile": {"type": ["string", "null"], "x-path": "profile"},
    "on_existing": {"type": "string", "enum": ["fail", "overwrite", "skip", "resume"]},
    "on_error": {"type": "string", "enum": ["continue", "stop"]},
    "missing": {"type": "string", "enum": ["error", "skip", "hold"]},
    "samples": {"type": "integer", "minimum": 1, "maximum": 64},
    "ppd": {"type": "number", "minimum": 1, "maximum": 200},
    "sidecar": {"type": "boolean"},
    "strict": {"type": "boolean"}}})";
inline constexpr const char* kAbSchema = R"({"required": ["chain", "chain_b", "input", "output"],
    "properties": {
    "chain": {"type": "string"},
    "chain_b": {"type": "string"},
    "input": {"type": "string", "x-path": "input"},
    "output": {"type": "string", "x-path": "folder"},
    "truth": {"type": ["string", "null"], "x-path": "pattern"},
    "on_existing": {"type": "string", "enum": ["fail", "overwrite", "skip"]}}})";
inline constexpr const char* kStudySchema = R"({"required": ["study", "output"], "properties": {
    "study": {"type": "string"},
    "output": {"type": "string", "x-path": "folder"},
    "on_existing": {"type": "string", "enum": ["fail", "overwrite", "skip"]}}})";

}  // namespace postchain::test
