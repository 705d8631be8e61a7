"""Puts fault points into C++ files: conditions, comparisons, returned truth values, statements of one line,
differences by one, signs of sums, minima and maxima. All faults are compiled at once and one is active at run time
(mutant schemata: Untch, Offutt, Harrold, Mutation Analysis Using Mutant Schemata, ISSTA 1993; fault_point.h).
"""

import re

# Places of the kinds of fault_point.h.
KINDS = ["always true", "always false", "boundary moved", "left out", "flipped", "1 is 0", "other sign", "other end"]
ALWAYS_TRUE, ALWAYS_FALSE, BOUNDARY, LEFT_OUT, FLIPPED, ONE_IS_ZERO, OTHER_SIGN, OTHER_END = range(len(KINDS))
NAMESPACE = "postchain::fault_point::"
ENDS = "postchain::ends::"

NO_CODE = re.compile(r"""//[^\n]*|/\*.*?\*/|R"([^(\s]*)\(.*?\)\1"|"(?:\\.|[^"\\\n])*"|(?<![0-9a-fA-F])'(?:\\.|[^'\\\n])+'
                         |^[ \t]*\#(?:\\\n|[^\n])*""", re.S | re.M | re.X)
OPENING, CLOSING = "([{", ")]}"
OTHER_BOUNDARY = {"<": "<=", "<=": "<", ">": ">=", ">=": ">"}
# Words that begin a statement that is no expression; macros and constructors.
NO_EXPRESSION = re.compile(
    r"(return|throw|break|continue|using|if|for|while|do|else|case|default|goto|co_\w+|static_assert|typedef|friend|public|"
    r"private|namespace|extern|template|struct|class|enum|virtual|explicit|inline|static|constexpr|const|auto|mutable|"
    r"_?exit|assert|abort|[A-Z]\w*(?=\())\b")
CALL = re.compile(r"[\w:.>-]+(<[\w:, ]*>)?([\w:.>-]|\[[^\]]*\]|\([^()]*\))*\(.*\)$", re.S)
ASSIGNMENT = re.compile(r"[\w:]+((\.|->)\w+|\[[^\]]*\])* [-+*/|&]?= ")


def without_text(text):
    """The code with each character of comments and preprocessor lines as a space, of literals as '$'."""
    def fill(match):
        sign = "$" if match[0][0] in "\"'R" else " "
        return "".join("\n" if c == "\n" else sign for c in match[0])
    return NO_CODE.sub(fill, text)


class Inserter:
    """Collects the points of one file. `first`: the number of its first point."""

    def __init__(self, text, first=0):
        self.text, self.code, self.first = text, without_text(text), first
        self.points = []  # (line, kinds, text)
        self.insertions = []  # (place, order, text)

    def point(self, begin, kinds, end):
        shown = " ".join(self.text[begin:end].split())
        self.points.append((self.text.count("\n", 0, begin) + 1, kinds, shown[:140]))
        return self.first + len(self.points) - 1

    def wrap(self, begin, end, before, after):
        """At one place, what ends comes before what begins; of what begins, the longer comes first."""
        self.insertions.append(((begin, 1, begin - end), before))
        self.insertions.append(((end, 0, end - begin), after))

    def top_level(self, begin, end):
        depth = 0
        for i in range(begin, end):
            if self.code[i] in OPENING:
                depth += 1
            elif self.code[i] in CLOSING:
                depth -= 1
            elif depth == 0:
                yield i

    def is_assignment(self, i):
        return self.code[i] == "=" and self.code[i + 1] != "=" and self.code[i - 1] not in "=<>!"

    def end_of_bracket(self, begin):
        depth = 0
        for i in range(begin, len(self.code)):
            depth += (self.code[i] in OPENING) - (self.code[i] in CLOSING)
            if depth == 0:
                return i
        return begin

    def parts(self, begin, end):
        """Of a condition, between && and || that are not in brackets."""
        last = begin
        for i in self.top_level(begin, end):
            if self.code[i:i + 2] in ("&&", "||") and self.code[i - 1].isspace():
                yield last, i
                last = i + 2
        yield last, end

    def add_condition(self, begin, end, kinds=(ALWAYS_TRUE, ALWAYS_FALSE)):
        for first, last in self.parts(begin, end):
            code = self.code[first:last]
            first += len(code) - len(code.lstrip())
            last -= len(code) - len(code.rstrip())
            code = self.code[first:last]
            if not code or "{" in code or code in ("true", "false"):
                continue
            before = f"{NAMESPACE}condition({self.point(first, kinds, last)}, static_cast<bool>("
            after = "))"
            if compared := self.comparison(first, last):
                at, sign = compared
                moved = self.text[first:at] + OTHER_BOUNDARY[sign] + self.text[at + len(sign):last]
                number = self.point(first, (BOUNDARY,), last)
                before += f"{NAMESPACE}is_active({number}, {NAMESPACE}boundary) ? ({moved}) : ("
                after = ")" + after
            self.wrap(first, last, before, after)

    def comparison(self, begin, end):
        """Place and sign of the only <, <=, > or >= of a condition."""
        code = self.code[begin:end]
        signs = re.findall(r" (<=|>=|<|>) ", code)
        if len(signs) != 1 or len(re.findall("[<>]", code.replace("->", ""))) != 1 or re.search("[?&|]", code):
            return None
        at = begin + code.index(f" {signs[0]} ") + 1
        return (at, signs[0]) if at in self.top_level(begin, end) else None

    def add_heads(self):
        """Conditions of `if` and `while`; no fault makes a loop endless."""
        for head in re.finditer(r"\b(if|while)\s*\(", self.code):
            begin, end = head.end(), self.end_of_bracket(head.end() - 1)
            for i in self.top_level(begin, end):
                if self.code[i] == ";":
                    begin = i + 1
            is_declaration = any(self.is_assignment(i) for i in self.top_level(begin, end))
            if not is_declaration:
                self.add_condition(begin, end, (ALWAYS_TRUE, ALWAYS_FALSE) if head[1] == "if" else (ALWAYS_FALSE,))

    def add_returns(self):
        for word in re.finditer(r"\breturn\s+", self.code):
            begin = word.end()
            end = next((i for i in self.top_level(begin, min(begin + 500, len(self.code))) if self.code[i] == ";"), begin)
            code = self.code[begin:end]
            if code in ("true", "false"):
                number = self.point(begin, (FLIPPED,), end)
                self.wrap(begin, end, f"{NAMESPACE}returned({number}, ", ")")
            elif "{" in code or " ? " in code or code.startswith("("):
                continue
            elif len(list(self.parts(begin, end))) > 1 or code.startswith("!") or any(
                    re.match(r" (==|!=|<=|>=) ", self.code[i:i + 4]) for i in self.top_level(begin, end)):
                self.add_condition(begin, end)

    def add_choices(self):
        """Conditions before `?`."""
        for sign in re.finditer(r" \? ", self.code):
            end, depth, begin = sign.start(), 0, 0
            for i in range(end - 1, max(end - 300, 0), -1):
                c = self.code[i]
                depth += (c in CLOSING) - (c in OPENING)
                if depth < 0 or depth == 0 and (c in ",;?" or self.is_assignment(i) or
                                                c == ":" and ":" not in (self.code[i - 1], self.code[i + 1])):
                    begin = i + 1
                    break
            returns = list(re.finditer(r"\breturn\b", self.code[begin:end]))
            begin += returns[-1].end() if returns else 0
            code = self.code[begin:end]
            if begin and not NO_EXPRESSION.match(code.strip()) and "<<" not in code and "\n\n" not in code:
                self.add_condition(begin, end)

    def add_statements(self):
        for line in re.finditer(r"(?m)^ +([A-Za-z_:][^\n;{}]*);$", self.code):
            begin, end = line.span(1)
            code = self.code[begin:end]
            before = self.code[:line.start()].rstrip()
            if NO_EXPRESSION.match(code) or not before or before[-1] not in ";{})" or any(
                    code.count(a) != code.count(b) for a, b in ("()", "[]")):
                continue
            if ASSIGNMENT.match(code) or CALL.match(code) and not re.match(r"[\w:<>]+ \w+\(", code):
                number = self.point(begin, (LEFT_OUT,), end)
                self.wrap(begin, end, f"{NAMESPACE}is_active({number}, {NAMESPACE}left_out) ? static_cast<void>(0) : "
                                      "static_cast<void>(", ")")

    def add_ones(self):
        for sign in re.finditer(r"(?<=[\w)\]]) [+-] (1)\b(?![.\w'])", self.code):
            begin, end = self.line_at(sign.start())
            if "static_assert" not in self.code[begin:end]:
                number = self.point(begin, (ONE_IS_ZERO,), end)
                self.wrap(sign.start(1), sign.end(1), f"{NAMESPACE}one({number}) * ", "")

    def line_at(self, place):
        return self.text.rfind("\n", 0, place) + 1, self.text.find("\n", place)

    def add_signs(self):
        """The second term's: operators that bind more strongly are applied to it first."""
        for sign in re.finditer(r"(?<=[\w)\]]) [+-] (?=[A-Za-z_(]|[02-9]|1[\w.'])", self.code):
            number = self.point(self.line_at(sign.start())[0], (OTHER_SIGN,), self.line_at(sign.start())[1])
            self.insertions.append(((sign.end(), 2, 0), f"{NAMESPACE}Sign{{{number}}} * "))

    def add_ends(self):
        for name in re.finditer(r"\bstd::(min|max)\((?!\{)", self.code):
            end = self.end_of_bracket(name.end() - 1)
            if sum(self.code[i] == "," for i in self.top_level(name.end(), end)) == 1:
                number = self.point(name.start(), (OTHER_END,), end + 1)
                self.insertions.append(((name.start(), 2, 0), ENDS))
                self.insertions.append(((name.end(), 0, 0), f"{number}, "))

    def result(self):
        for add in (self.add_heads, self.add_returns, self.add_choices, self.add_statements, self.add_ones,
                    self.add_signs, self.add_ends):
            add()
        parts, last = [], 0
        for (place, *_), inserted in sorted(self.insertions, key=lambda one: one[0]):
            parts += [self.text[last:place], inserted]
            last = place
        text = "".join(parts) + self.text[last:]
        if self.points:
            include = '#include "tests/mutants/points/fault_point.h"\n'
            once = "#pragma once\n"
            text = text.replace(once, once + include, 1) if once in text else include + text
        return text
