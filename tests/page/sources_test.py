"""Sources of the pages: no text of a file becomes HTML, nothing comes from elsewhere, and
bundle.cmake keeps what modules mean.

usage: sources_test.py CMAKE"""
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

FOLDER = pathlib.Path(__file__).resolve().parents[2] / "tools/page"
SOURCES = [file for kind in ("js", "html") for file in FOLDER.rglob(f"*.{kind}") if file.parent.name != "uplot"]
SVG = '"http://www.w3.org/2000/svg"'  # a name, not an address


class Sources(unittest.TestCase):
    def test_no_way_from_text_to_html(self):
        self.assertGreater(len(SOURCES), 30)
        for file in SOURCES:
            text = file.read_text(encoding="utf8").replace(SVG, "")
            for word in ("innerHTML", "outerHTML", "insertAdjacentHTML", "document.write", "DOMParser", "setHTML",
                         "createContextualFragment", "eval(", "new Function", "srcdoc", "javascript:", "http://",
                         "https://"):
                self.assertNotIn(word, text, file.name)
            self.assertNotRegex(text, r"<[^>]*\s(on\w+|style)=", file.name)

    def test_labels_are_spelled_as_browsers_know_them(self):
        known = {"label", "labelledby", "describedby", "live", "hidden", "pressed", "current",
                 "busy", "expanded", "haspopup", "valuetext", "roledescription", "valuemin",
                 "valuemax", "valuenow", "selected", "controls"}
        for file in SOURCES:
            for word in file.read_text(encoding="utf8").split("aria-")[1:]:
                self.assertIn(word.split('"')[0].split("=")[0].split("]")[0], known, file.name)

    def test_the_page_names_its_plot_library(self):
        version = (FOLDER / "uplot/uPlot.iife.min.js").read_text(encoding="utf8").split("(v")[1]
        page = (FOLDER / "report/page.html").read_text(encoding="utf8")
        self.assertIn(f"Contains uPlot {version.split(')')[0]}:\n{{{{text uplot/LICENSE}}}}", page)


class Bundle(unittest.TestCase):
    def bundle(self, page="{{modules a.js}}", **files):
        with tempfile.TemporaryDirectory() as folder:
            folder = pathlib.Path(folder)
            (folder / "page.html").write_text(page)
            (folder / "b").mkdir()
            for name, text in files.items():
                (folder / f"{name.replace('_', '/')}.js").write_text(text)
            done = subprocess.run(
                [CMAKE, f"-DROOT={folder}", "-DPAGE=page.html", f"-DOUTPUT={folder}/out", "-P",
                 FOLDER / "bundle.cmake"], capture_output=True, text=True, check=False)
            return (folder / "out").read_text() if done.returncode == 0 else done.stderr

    def test_each_module_comes_once_and_before_its_users(self):
        text = self.bundle(
            page="<p>[;]</p><script>{{modules a.js}}</script>",
            a='import {\n    f, kB,\n} from "./b/c.js";\nimport { g } from "./d.js";\nf(g, kB);\n',
            b_c='// not kept\nimport { g } from "../d.js";\nexport const kB = "[a;b]\\\\n";\n'
                'export async function f() { return g; }\n',
            d="export class g {}\n")
        self.assertTrue(text.startswith('<p>[;]</p><script>"use strict";\n(() => {\nconst d_js = '))
        self.assertTrue(text.endswith("})();\n</script>"))
        self.assertNotIn("not kept", text)
        self.assertEqual(text.count("class g {}"), 1)
        self.assertIn("const { g } = d_js;", text)
        self.assertIn('const kB = "[a;b]\\\\n";', text)
        self.assertIn("return { kB, f };", text)
        self.assertIn("const {\n    f, kB,\n} = b_c_js;", text)
        self.assertLess(text.index("const b_c_js"), text.index("const a_js"))
        if shutil.which("node"):
            code = text.split("<script>")[1].split("</script>")[0]
            subprocess.run(["node", "-e", code], check=True)

    def test_what_it_cannot_keep_is_refused(self):
        circle = self.bundle(a='import { b } from "./d.js";\nexport const a = 1;\n',
                             d='import { a } from "./a.js";\nexport const b = 1;\n')
        self.assertIn("a.js imports d.js imports a.js", circle)
        for text in ("export default 1;\n", 'import "./b.js";\n', "const a = '</script>';\n"):
            self.assertIn("cannot be bundled", self.bundle(a=text), text)
        self.assertIn("unknown mark", self.bundle(page="{{code a.js}}", a=""))


if __name__ == "__main__":
    CMAKE = sys.argv.pop(1)
    unittest.main()
