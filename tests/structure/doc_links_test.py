"""Every link of README.md, its neighbors, docs/ and tools/ leads to a file and a heading that exist, every page named in a
comment exists, and every page can be reached from README.md."""
import functools
import posixpath
import re
import typing

import files

LINK = re.compile(r"\]\(([^)\s]+)\)", re.A)
HEADING = re.compile(r"#+ +(.*\S) *", re.A)
CODE = re.compile(r"`[^`]*`")
NAMED = re.compile(r"(?<![/\w])docs/[\w/]+\.(md|html)", re.A)


class Page(typing.NamedTuple):
    links: list  # (line, target): "docs/frame.md#depth", "#depth", "images/wheels.jpg"
    anchors: set


def anchor_of(heading):
    """Anchor of a heading in rendered Markdown: letters, digits, - and _, spaces as -."""
    return re.sub(r"[^\w -]", "", heading, flags=re.A).lower().replace(" ", "-")


def read_page(name):
    page, fenced = Page([], set()), False
    for number, text in enumerate(files.file_of(name).lines, 1):
        fenced ^= text.startswith("```")
        if fenced:
            continue
        if heading := HEADING.fullmatch(text):
            page.anchors.add(anchor_of(heading[1]))
        page.links.extend((number, target) for target in LINK.findall(CODE.sub("", text)))
    return page


@functools.cache
def pages():
    """By name relative to the root: its own pages, and every page below docs/ and tools/."""
    names = [path.name for path in sorted(files.ROOT.glob("*.md"))]
    names += [file.name for file in files.files_below(["docs", "tools"], {".md"})]
    return {name: read_page(name) for name in names}


def is_external(target):
    return "://" in target or target.startswith("mailto:")


def file_of(page, target):
    """File that a link on `page` leads to, relative to the root."""
    path = target.split("#")[0]
    return posixpath.normpath(posixpath.join(posixpath.dirname(page), path)) if path else page


def fault_of(page, target):
    """The fault of a link; empty = none."""
    if is_external(target):
        return ""
    file, (_, mark, anchor) = file_of(page, target), target.partition("#")
    if not files.is_here(file):
        return ""
    is_folder = (files.ROOT / file).is_dir()
    if not is_folder and (target.split("#")[0].endswith("/") or not (files.ROOT / file).exists()):
        return f"leads to {file}, which does not exist"
    if mark and (file not in pages() or anchor not in pages()[file].anchors):
        return f"{file} has no heading for #{anchor}"
    return ""


class DocLinks(files.Case):
    def test_lead_to_a_file_and_a_heading(self):
        links = [(name, *link) for name, page in pages().items() for link in page.links]
        self.expect_none(f"{name}:{line}: {fault}" for name, line, target in links if (fault := fault_of(name, target)))
        self.assertGreater(len(links), 50, "the search found too few links")

    def test_every_page_is_reachable_from_the_readme(self):
        seen, left = set(), {"README.md"}
        while left:
            seen |= left
            linked = {file_of(name, target) for name in left for _, target in pages()[name].links
                      if not is_external(target)}
            left = linked & pages().keys() - seen
        self.expect_none(f"{name} cannot be reached from README.md" for name in pages() if name not in seen)

    def test_pages_named_in_plain_text_exist(self):
        """Comments and pages also name pages in plain text: "docs/frame.md"."""
        found = files.files_below(["chain", "passes", "shaders", "config", "tools", "tests", "docs"],
                                  {".h", ".cpp", ".comp", ".glsl", ".txt", ".yaml", ".sh", ".js", ".py", ".md"})
        found.append(files.file_of("README.md"))
        names = [(place, match[0]) for file in found for place, match in file.matches(NAMED)]
        self.expect_none(f"{place}: no {page}" for place, page in names if not (files.ROOT / page).exists())
        self.assertGreater(len(names), 50, "the search found too few names")

    def test_faults_are_seen(self):
        self.assertEqual(anchor_of("What `run` does, and why (1/d)"), "what-run-does-and-why-1d")
        for bad in ("docs/no-such-page.md", "docs/frame.md/", "docs/frame.md#nowhere"):
            self.assertNotEqual(fault_of("README.md", bad), "", bad)
        for good in ("../README.md#try-it", "#depth", "https://example.org/x.md"):
            self.assertEqual(fault_of("docs/frame.md", good), "", good)
