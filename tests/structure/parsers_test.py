"""Texts from outside are read by config/text_tree and by read_json() of tools/sequence/files/json, which limit what they
take. Other calls of the parsers read what the program has just written itself, or may be as wide as they like."""
import re
import unittest

import files

PARSERS = re.compile(r"\b[Jj]son::(parse|sax_parse|accept)\(|\byaml_parser_\w+\(")

MAY_PARSE = {
    "config/text_tree.cpp": "the one that does",
    "tools/sequence/planes/cryptomatte.cpp": "manifests have any number of names",
    "tools/python/documentation.cpp": "the passes of this program",
    "tools/service/http/message.cpp": "a reply of this program",
    "tools/service/work/service.cpp": "an event of this program, and what the store keeps of a job",
    "tools/service/preview/main.cpp": "between the service and its process",
}


class Parsers(files.Case):
    def test_texts_are_read_in_one_place(self):
        sources = files.files_below(["chain", "passes", "config", "tools"], {".cpp"})
        used = {file.name: file.matches(PARSERS) for file in sources if file.matches(PARSERS)}
        self.expect_none(f"{place}: use read_text_tree() or io::read_json()"
                         for name, found in used.items() if name not in MAY_PARSE for place, _ in found)
        self.assertEqual(set(used), {file for file in MAY_PARSE if files.is_here(file)}, "the list is up to date")


if __name__ == "__main__":
    unittest.main()
