"""Transcripts: each file of transcripts/ has commands and everything that they print, compared word by word. A
fault in any name, number, order or message of a record fails, also one that no test of its own asks for.

A line `$ COMMAND` begins a step (bash, in one folder per file; `> ` continues it). The lines up to the next step are
its stdout and stderr, then `[exit code N]` unless it is 0. Notes between them begin with #, or are empty.

postchain is the built command, python this interpreter. Functions:
    pretty [--digits N] [PATH ...]   indents JSON, or what the dotted paths choose; numbers have six digits, or N: three
                                     for what a GL device computes
    means FILE [CHANNELS]            mean of each quadrant of the channels of an EXR that match
    edit IN OUT CODE                 copies an EXR through Python: `picture` of exr.py
    patch IN OUT CODE                copies any file: `data`, a bytearray
    options                      sections of a man page with their options and choices
    part NAME [WORD ...]             the program of a part, beside the command
    chain TEXT [OPTION ...]          plans a chain file of this text
    camera TEXT, profile TEXT        inspect a frame with such a file
A folder's prelude.sh has more. The working folder has in.0001.exr to in.0004.exr (see frames()). A word stands for what
varies between runs and machines: T for times, H1, H2, ... for hashes in the order of the file, so that equal ones stay
equal.

usage: transcript_test.py POSTCHAIN NAME|PATH ...   POSTCHAIN_UPDATE=1 rewrites the files (tools/update_expected.sh)"""
import difflib
import json
import math
import os
import pathlib
import re
import struct
import subprocess
import sys
import tempfile
import textwrap

import exr

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parents[1]
WIDTH, HEIGHT = 32, 18
PRELUDE = f"""set -o pipefail
python() {{ {sys.executable} -B "$@"; }}
tool() {{ {sys.executable} -S -B {HERE}/transcript_test.py "$@"; }}
pretty() {{ tool --pretty "$@"; }}
means() {{ tool --means "$@"; }}
edit() {{ tool --edit "$@"; }}
patch() {{ tool --patch "$@"; }}
options() {{ tool --options; }}
part() {{ "$(dirname "$(readlink -f "$(command -v postchain)")")/postchain-$1" "${{@:2}}"; }}
chain() {{ echo "$1" >chain.yaml; postchain plan chain.yaml -i in.0002.exr "${{@:2}}"; }}
inspected() {{ postchain inspect in.0002.exr --json "$@"; }}
camera() {{ echo "$1" >camera.json; inspected --camera camera.json -v | pretty frame.camera; }}
profile() {{ echo "$1" >profile.yaml; inspected --profile profile.yaml | pretty match bounds; }}
"""
# (pattern, replacement), in this order; the folder and the root of the sources before them.
VARYING = (
    (r"\b\d+(\.\d+)? (ms|s)\b", r"T \2"),
    (r"\b\d+:\d\d( elapsed| to go)|( in )\d+:\d\d\b", r"\2T\1"),
    (r"(?m)^((?: +\d+){5} +\d+\.\d+ +)\d+\.\d+", r"\1T"),  # seconds of `check`
    (r'("(?:output_bytes|frames_in_flight)": )\d+', r"\1N"),  # paths are in the file; time decides
    (r'("(?:ms|[a-z_]*_ms|read|convert|filter|write|elapsed_s|remaining_s|seconds|[a-z_]*_seconds)": )'
     r"[0-9][0-9.e+-]*", r"\1T"),
    (r"\bllvmpipe \([^)]*\)", "RENDERER"),
    (r", \d+\.\d+ \(Core Profile\) Mesa [^\"\n]*", ", GL"),
    (r"\b20\d\d-\d\d-\d\d[T ]\d\d:\d\d:\d\d(\.\d+)?Z?", "TIME"),
)


def frames(folder):
    """Four frames as Blender names them: a near half that moves by a pixel to the right and a quarter up per frame
    before a still one, a layer of emission, an attribute. Every value is another one."""
    at = [(x, y) for y in range(HEIGHT) for x in range(WIDTH)]
    for n in range(1, 5):
        near = [x < WIDTH // 2 + n for x, _ in at]
        own = [(x - n, y + n / 4) if one else (x, y) for (x, y), one in zip(at, near)]  # place on the surface
        picture = exr.flat(WIDTH, HEIGHT, {
            f"ViewLayer.{name}": values for name, values in {
                "Combined.R": [0.5 + math.sin(0.9 * u + 0.5 * v) / 4 for u, v in own],
                "Combined.G": [0.6 + math.sin(0.4 * u - 0.8 * v) / 3 for u, v in own],
                "Combined.B": [(y + 1) / 20 for _, y in at],
                "Combined.A": [1.0] * len(at),
                "Depth.Z": [4.0 if one else 8.0 for one in near],
                "Emit.R": [(x + 1) / 80 for x, _ in at],
                "Emit.G": [(y + 1) / 40 for _, y in at],
                "Emit.B": [n / 16] * len(at),
                "Vector.X": [-1.0 if one else 0.0 for one in near],
                "Vector.Y": [-0.25 if one else 0.0 for one in near],
                "Vector.Z": [-1.0 if one else 0.0 for one in near],
                "Vector.W": [-0.25 if one else 0.0 for one in near],
            }.items()})
        picture.attributes["comments"] = "string", f"take {n}".encode()
        picture.attributes["framesPerSecond"] = "rational", struct.pack("<iI", 24, 1)
        exr.write(folder / f"in.{n:04}.exr", picture)


def steps(text):
    """Lists of lines: what comes before a step is its own list without a command."""
    found = [[]]
    for line in text.splitlines():
        if line.startswith("$ "):
            found.append([])
        found[-1].append(line)
    return found


class Replaced:
    """Replaces what varies; hashes are numbered over all texts that it has seen."""

    def __init__(self, folder, version):
        self.folder, self.version, self.hashes = folder, version, {}

    def __call__(self, text):
        text = text.replace(str(self.folder), "FOLDER").replace(str(ROOT), "SOURCE")
        text = re.sub(rf"(?<![\d.]){re.escape(self.version)}(?![\d.])", "VERSION", text)
        for pattern, word in VARYING:
            text = re.sub(pattern, word, text)
        return re.sub(r"(?<![\w.])[0-9a-f]{16}\b",
                      lambda one: self.hashes.setdefault(one[0], f"H{len(self.hashes) + 1}"), text)


TOKEN = re.compile(r'"(?:[^"\\]|\\.)*"|[^"]')


def pieces(text):
    """What stands between the commas of a JSON text that are in no brackets."""
    found, depth = [""], 0
    for token in TOKEN.findall(text):
        depth += (token in "{[") - (token in "}]")
        if token == "," and not depth:
            found.append("")
        else:
            found[-1] += token
    return [one.strip() for one in found]


def layout(text, width, filled=False, indent=""):
    """A JSON text of one line: on one line if it fits, else one line per member, or lines filled with members."""
    begin = re.match(r'("(?:[^"\\]|\\.)*": |[\w.$]+: )?[{\[]', text)
    if len(indent + text) <= width or not begin:
        return text
    members = [layout(one, width, filled, indent + " ") for one in pieces(text[begin.end():-1])]
    if not filled:
        return begin[0] + ",".join(f"\n{indent} {one}" for one in members) + f"\n{indent}{text[-1]}"
    lines, more = [indent + begin[0]], False
    for one, end in zip(members, [", "] * (len(members) - 1) + [text[-1]]):
        several = "\n" in one
        if more and (several or len(lines[-1] + one + end) > width + 1):
            lines[-1] = lines[-1].rstrip()
            lines.append(indent + " ")
        lines[-1] += one + end
        more = len(lines) > 1 or lines[-1] != indent + begin[0]
    return "\n".join(lines)[len(indent):]


def filled(lines):
    """The lines with each JSON text laid out anew: the words for what varies have other widths."""
    found, at = [], 0
    while at < len(lines):
        end, text, depth = at, "", 0
        while re.match(r"([\w.$]+: )?[{\[]", lines[at]) and end < len(lines) and (end == at or depth):
            line = lines[end].strip()
            text += ("" if not text or text[-1] in "{[" or line[:1] in ("}", "]") else " ") + line
            depth = sum((token in "{[") - (token in "}]") for token in TOKEN.findall(text))
            end += 1
        if end > at and not depth and text[-1] in "}]" and len(pieces(text)) == 1:
            found += layout(text, 120, filled=True).splitlines()
        else:
            end = at + 1
            found.append(lines[at])
        at = end
    return found


def played(path, postchain):
    """The transcript as it is with this command."""
    lines = []
    with tempfile.TemporaryDirectory() as temporary:
        folder, programs = pathlib.Path(temporary, "work"), pathlib.Path(temporary, "programs")
        for one in (folder, programs):
            one.mkdir()
        (programs / "postchain").symlink_to(postchain)
        frames(folder)
        replaced = Replaced(folder, subprocess.run([postchain, "--version"], capture_output=True, text=True,
                                                   check=True).stdout.split()[-1])
        environment = dict(os.environ, PATH=f"{programs}:{os.environ['PATH']}", SOURCE=str(ROOT),
                           PYTHONDONTWRITEBYTECODE="1", LC_ALL="C.UTF-8",
                           MESA_SHADER_CACHE_DIR=os.path.expanduser("~/.cache"))  # for services too
        environment.pop("OCIO", None)
        beside = path.with_name("prelude.sh")
        prelude = PRELUDE + (beside.read_text(encoding="utf8") if beside.exists() else "")
        for step in steps(path.read_text(encoding="utf8")):
            said = len(step)
            while said and (not step[said - 1] or step[said - 1].startswith("#")):
                said -= 1
            command = [line for line in step if line.startswith(("$ ", "> "))]
            lines += command
            if command:
                done = subprocess.run(
                    ["bash", "-c", prelude + "\n".join(line[2:] for line in command)], cwd=folder, env=environment,
                    timeout=300, text=True, errors="backslashreplace", stdout=subprocess.PIPE,
                    stderr=subprocess.STDOUT, stdin=subprocess.DEVNULL, check=False)
                # A printed line that looks like a note or a command gets a space.
                lines += filled([" " + line if line[:2] in ("#", "# ", "##", "$ ", "> ") else line
                                 for line in replaced(done.stdout).splitlines() if line])
                if done.returncode:
                    lines.append(f"[exit code {done.returncode}]")
            lines += step[said:]
    return "\n".join(lines) + "\n"


def rounded(value, digits):
    """A JSON value whose numbers have so many digits."""
    if isinstance(value, float):
        return float(f"{value:.{digits}g}")
    if isinstance(value, dict):
        return {key: rounded(member, digits) for key, member in value.items()}
    return [rounded(member, digits) for member in value] if isinstance(value, list) else value


def means(file, channels=""):
    """Mean of the left and right half of the upper rows, then of the lower ones, with three digits."""
    picture = exr.read(file)
    for name in sorted(picture.channels):
        if not re.search(channels, name):
            continue
        values, shown = picture.values(name), []
        for rows in (range(picture.height // 2), range(picture.height // 2, picture.height)):
            for columns in (range(picture.width // 2), range(picture.width // 2, picture.width)):
                part = [values[y * picture.width + x] for y in rows for x in columns]
                shown.append(f"{sum(part) / len(part):.3g}")
        print(name, *shown)


def options():
    """Each section of a man page with its options and their choices."""
    sections = []
    for line in sys.stdin.read().replace("\\", "").splitlines():
        if line.startswith(".SH "):
            sections.append([line[4:] + ":"])
        elif line.startswith(".B "):
            option = re.search(r"--[a-z-]+", line) or re.match(r"(postchain )?\S+", line[3:])
            choices = re.search(r":(\{[^}]+\})", line)
            sections[-1].append(option[0] + (choices[1] if choices else ""))
    print("\n".join(textwrap.fill(" ".join(one), 120, subsequent_indent=" ", break_on_hyphens=False)
                    for one in sections))


def edit(source, target, code):
    picture = exr.read(source)
    exec(code, {"picture": picture, "struct": struct, "exr": exr})  # pylint: disable=exec-used
    exr.write(target, picture)


def patch(source, target, code):
    data = bytearray(pathlib.Path(source).read_bytes())
    exec(code, {"data": data, "struct": struct})  # pylint: disable=exec-used
    pathlib.Path(target).write_bytes(data)


def pretty(words):
    """JSON of stdin, one document or one per line; lines that are none stay as they are."""
    digits = int(words[1]) if words[:1] == ["--digits"] else 6
    paths = words[2:] if words[:1] == ["--digits"] else words
    text = sys.stdin.read()
    for part in [text] if text.startswith("{\n") else text.splitlines():
        if not part.startswith("{"):
            print(part)
            continue
        document = json.loads(part)
        for path in paths or [""]:
            chosen = [document]
            for key in filter(None, path.split(".")):
                chosen = [one[int(key)] if isinstance(one, list) else one[key] for one in chosen
                          if isinstance(one, list) or key in one]
            print("".join((path and f"{path}: ") + layout(json.dumps(rounded(one, digits)), 110) for one in chosen) or f"{path}: none")


def main():
    words = sys.argv[1:]
    if words[0] in ("--means", "--edit", "--patch"):
        return {"--means": means, "--edit": edit, "--patch": patch}[words[0]](*words[1:])
    if words[0] == "--options":
        return options()
    if words[0] == "--pretty":
        return pretty(words[1:])
    postchain, *names = words
    failed = 0
    for name in names:
        path = HERE / "transcripts" / f"{name}.txt"
        expected = "\n".join(filled(path.read_text(encoding="utf8").splitlines())) + "\n"
        found = played(path, pathlib.Path(postchain).resolve())
        if os.environ.get("POSTCHAIN_UPDATE"):
            path.write_text(found, encoding="utf8")
        elif expected != found:
            failed = 1
            print("\n".join(difflib.unified_diff(expected.splitlines(), found.splitlines(), str(path), "printed",
                                                 lineterm="", n=8)))
    return failed


if __name__ == "__main__":
    sys.exit(main())
