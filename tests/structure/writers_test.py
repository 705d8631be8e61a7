"""Lists every place that writes a file (docs/command.md, "What is written, and what is never replaced"). Only
tools/sequence/files/atomic_file opens files for writing, and only tools/sequence/files/output_files decides what may
be replaced. All writers use it and are listed here; tests/command/replace_test.cpp and replace_report_test.cpp try each
of them with foreign files and with inputs."""
import collections
import functools
import re

import files

COMMENT = re.compile("(?<![:/])//.*")  # not a URL in a string

# Everything that can make, change or remove a file without the atomic writer.
WAYS = (
    r"\b(ofstream\b|fopen\b|freopen\b|fdopen\b|FILE\s*\*|creat\(|mkstemp|O_WRONLY\b|O_RDWR\b|O_CREAT\b|truncate\("
    r"|resize_file\b|copy_file\b|fs::copy\b|filesystem::copy\b|rename(at2?)?\(|symlink\(|ImageOutput\b"
    r"|ImageBuf\b.*write|png_image_write_to_(file|stdio)\b|png_init_io\b|mmap\(|system\(|popen\()"
    r"|::(fstream\b|remove(_all)?\(|unlink\(|link\()|Imf::\w*OutputFile\b"
    r"|create_hard_link|create_symlink|_printer_file|basic_file_sink")

MAY_OPEN = {
    "tools/sequence/files/atomic_file.cpp": "the one that does",
    "tools/sequence/exr/exr_output.cpp": "OpenEXR, on a stream of the atomic file",
    "tools/sequence/exr/deep_writer.cpp": "OpenEXR, on a stream of the atomic file",
    "tools/sequence/image/image_codec.cpp": "OpenImageIO, into memory",
    "tools/measure/experiment/report_folder.cpp": "removes a report or study that is replaced",
    "tools/service/store/store_file.cpp": "SQLite, into a copy that gets its name when it is whole; a lock",
    "tools/service/work/job_request.cpp": "texts of requests, in a folder of the service",
    "tools/service/work/job_runner.cpp": "removes folders of jobs, in a folder of the service",
    "tools/service/work/local_queue.cpp": "messages and exit codes of jobs, in a folder of the service; /dev/null",
    "tools/service/work/programs.cpp": "removes its own folders",
    "tools/apps/postchain/selftest.cpp": "removes the folder that it has made",
    "tools/apps/programs/program_files.cpp": "removes programs of an earlier call, in a folder with its mark",
    "tools/apps/view/main.cpp": "removes the folder of a scene that it has rendered",
    "tools/apps/view/open_chain.cpp": "removes its own file of edits; a lock",
    "tools/apps/common/state.cpp": "an empty file whose time counts",
    "tools/apps/common/program.cpp": "/dev/null for streams that are closed",
}

# Places that write. New writers also belong in tests/command/replace_test.cpp or replace_report_test.cpp.
WRITERS = {
    "tools/sequence/run/output_frame.cpp": 5,  # output: EXR, new EXR, other image; preview, sidecar
    "tools/sequence/run/run_sequence.cpp": 1,  # stage
    "tools/scenes/scene.cpp": 4,  # images, deep images, aperture image, camera.json
    "tools/apps/postchain/diff.cpp": 2,  # maps
    "tools/apps/postchain/selftest.cpp": 1,  # in its own folder
    "tools/apps/programs/program_files.cpp": 2,  # programs and index.json, in a folder with its mark
    "tools/sequence/run/sheet.cpp": 1,
    "tools/python/write_call.cpp": 2,  # an EXR, another format
    "tools/apps/view/save.cpp": 1,  # chain, camera, image, sheet, movie, state of the viewer
    "tools/measure/program/stress.cpp": 3,
    "tools/measure/program/tune.cpp": 2,
    "tools/measure/report/report.cpp": 1,  # json, csv, md, images of the page, chains
    "tools/measure/report/images.cpp": 2,  # images/
    "tools/measure/report/page/page.cpp": 1,  # index.html
    "tools/measure/experiment/result_store.cpp": 2,  # results/
    "tools/measure/experiment/experiment_input.cpp": 1,  # truth/
    "tools/measure/study/study_folder.cpp": 1,  # tasks/, report files of a study
}
# Their callers ask what may be replaced.
LIBRARIES = tuple(f"tools/sequence/{folder}/" for folder in ("exr", "files", "image", "planes"))

OVERWRITE = r"(?<![=!]= )(?<!io::)(io::)?\bOnExisting::overwrite"  # not in a comparison
MAY_OVERWRITE = {
    "tools/sequence/files/atomic_file.cpp", "tools/sequence/files/output_files.cpp",
    "tools/apps/common/options.cpp", "tools/apps/view/save.cpp",
    "tools/apps/programs/program_files.cpp",  # its own programs, in a folder with its mark
    "tools/measure/study/work.cpp",  # its own results, in a folder with the mark of a study
    "tools/measure/program/tune.cpp",  # its own chain file of a stopped walk, unless it was edited
}


@functools.cache
def sources():
    """Without line comments."""
    return [files.File(file.name, COMMENT.sub("", file.text))
            for file in files.files_below(["chain", "passes", "config", "tools"], {".cpp", ".h"})]


def matches_of(pattern):
    """Every occurrence: file, place, match."""
    pattern = re.compile(pattern, re.A | re.M)
    return [(file.name, *match) for file in sources() for match in file.matches(pattern)]


def count(pattern):
    """Number of occurrences by file, without declarations in headers."""
    return collections.Counter(file for file, _, _ in matches_of(pattern) if not file.endswith(".h"))


class Writers(files.Case):
    def test_nothing_else_opens_a_file_for_writing(self):
        met = count(WAYS)
        self.expect_none([f"{file} opens, replaces or removes a file; write through AtomicFile"
                          for file in met if file not in MAY_OPEN]
                         + [f"{file} no longer does: {why}" for file, why in MAY_OPEN.items() if file not in met and files.is_here(file)])

    def test_open_exr_and_open_image_io_get_no_file_name(self):
        exr = matches_of(r"Imf::\w*OutputFile\w*(\s+\w+)?\((\w+)")
        other = matches_of(r"\bout->open\(([^,]+),")
        self.expect_none([place for _, place, found in exr if found[2] != "stream"]
                         + [place for _, place, found in other if found[1] not in ('"memory.png"', "memory.path()")])

    def test_are_these_and_ask_what_may_be_replaced(self):
        found = count(r"\bAtomicFile::create\(|\batomic_write_text\(|\bwrite_(planes|deep)_exr\(|\bwrite_filtered\("
                      r"|\bwrite_png_preview\(|\bio::write_picture\(|\bfiles_?\.put\(")
        found = {file: times for file, times in found.items() if not file.startswith(LIBRARIES)}
        permits = count(r"\b(permit|put)\(")
        self.expect_none([f"{file} writes at {found.get(file, 0)} places; listed: {WRITERS.get(file, 0)}"
                          for file in found | WRITERS
                          if found.get(file) != WRITERS.get(file) and files.is_here(file)]
                         + [f"{file} does not use OutputFiles::permit() or put()" for file in found if file not in permits])

    def test_remove_what_kills_left(self):
        """Before its first write, a job checks all of its files and then removes leftovers of killed jobs."""
        checks = count(r"\bfiles(->|\.)check(_names)?\(\)")
        removals = count(r"\bremove_left_temporaries\(\);")
        self.expect_none(f"{file} does not remove them" for file in checks if file not in removals)
        self.assertGreaterEqual(len(checks), 5, sorted(checks))

    def test_only_one_place_says_overwrite(self):
        """Only the one place, and the words of an option, may allow replacing a file."""
        met = matches_of(OVERWRITE)
        self.expect_none(place for file, place, _ in met if file not in MAY_OVERWRITE)
        self.assertGreaterEqual(len(met), 2)

    def test_faults_are_seen(self):
        for code in ("std::ofstream file(path);", 'FILE* f = fopen(path, "w");', "std::fstream both(path);",
                     "::open(path, O_WRONLY | O_CREAT)", "fs::rename(a, b);", "Imf::TiledOutputFile out(path);",
                     "auto out = OIIO::ImageOutput::create(path);", "fs::copy_file(a, b);", "std::remove(path);"):
            self.assertRegex(code, WAYS)
        for code in ("std::ifstream file(path);", "std::remove_if(a, b, c)", "::open(path, O_RDONLY)"):
            self.assertNotRegex(code, WAYS)
        for code in ("mode = OnExisting::overwrite", "f(io::OnExisting::overwrite)", "? OnExisting::overwrite : mode"):
            self.assertRegex(code, OVERWRITE)
        for code in ("mode == io::OnExisting::overwrite", "mode != OnExisting::overwrite"):
            self.assertNotRegex(code, OVERWRITE)
