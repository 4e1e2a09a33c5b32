#!/usr/bin/env python3
"""Changes one line of the production code at a time and lists the changes that no test notices.

A change that survives shows a line that no test of its module holds. `./dev mutants` calls this script.
"""

import argparse
import hashlib
import json
import os
import re
import resource
import signal
import subprocess
import sys
import time
from dataclasses import asdict, dataclass
from pathlib import Path

MODULES = ["core", "levelset", "mesh", "flux", "models", "apps"]
LEFT_OUT = ("apps/viewer/",)


@dataclass(frozen=True)
class Mutant:
    """One changed line. Lines count from 1; before and after are whole lines."""

    file: str
    line: int
    kind: str
    before: str
    after: str


# --- What of a source is code ---


def blank(text):
    """As many blanks, with the same ends of lines."""
    return re.sub(r"[^\n]", " ", text)


# Comments, strings and characters. The quote of 1'000 begins no character.
TOKEN = re.compile(
    r"""(?P<comment>//[^\n]*|/\*.*?\*/)
      | (?P<raw>\bu?8?R"(?P<mark>[^\s()\\]*)\(.*?\)(?P=mark)")
      | (?P<string>"(?:\\.|[^"\\\n])*"|(?<![0-9A-Fa-f])'(?:\\.|[^'\\\n])+')""",
    re.VERBOSE | re.DOTALL,
)
# Statements that tell somebody something, and those that the compiler checks.
MESSAGE = re.compile(r"\b(?:static_assert|throw|fmt::\w+|\w*(?:Error|ASSERT|assert)|std::c(?:err|out))\b|\b\w+\.(?:info|warn)\(")
# Lines that declare and compute nothing.
DECLARATION = re.compile(r"\s*(?:template|requires|concept|using|namespace|friend|class|struct|enum|union|public:|private:)\b")
DIRECTIVE = re.compile(r"^[ \t]*#(?:[^\n]*\\\n)*[^\n]*", re.MULTILINE)


def end_of_statement(text, start):
    """The place of the semicolon, or of the bracket, that ends the statement around start."""
    depth = 0
    for place in range(start, len(text)):
        if text[place] in "([{":
            depth += 1
        elif text[place] in ")]}":
            depth -= 1
            if depth < 0:
                return place
        elif text[place] == ";" and depth == 0:
            return place
    return len(text)


def code_of(text):
    """The text with blanks for all that is not to be changed: comments, strings, directives, messages, declarations."""

    def without_words(match):
        if match["comment"]:
            return blank(match[0])
        inside = match[0][1:-1]
        return '"' + blank(inside) + '"'

    text = TOKEN.sub(without_words, text)
    text = DIRECTIVE.sub(lambda match: blank(match[0]), text)
    place = 0
    while match := MESSAGE.search(text, place):
        end = end_of_statement(text, match.start())
        text = text[: match.start()] + blank(text[match.start() : end]) + text[end:]
        place = match.end()
    lines = text.split("\n")
    return "\n".join(blank(line) if DECLARATION.match(line) else line for line in lines)


# --- The changes ---

SWAPS = {
    "comparison": {"<": "<=", "<=": "<", ">": ">=", ">=": ">", "==": "!=", "!=": "=="},
    "arithmetic": {"+": "-", "-": "+", "*": "/", "/": "*", "%": "*", "+=": "-=", "-=": "+=", "*=": "/=", "/=": "*="},
    "logic": {"&&": "||", "||": "&&"},
}
# clang-format puts blanks around the operators with two operands, and only around these.
OPERATOR = re.compile(r"(?<=\S\s)(?:[<>=!]=|[-+*/]=|&&|\|\||[-+*/%<>])(?=\s|$)")
TRUTH = re.compile(r"\b(?:true|false)\b")
NUMBER = re.compile(r"(?<![\w.<])(?:0[xX][0-9a-fA-F']+|\d[\d']*(?:\.\d*)?(?:[eE][-+]?\d+)?)(?P<suffix>[fFuUlLzZ]*)(?![\w.>])")
PURE_VIRTUAL = re.compile(r"\)[\w ]*= 0;")
EXTREMUM = re.compile(r"\bstd::(min|max)(?=[(<]|_element)")
CONDITION = re.compile(r"\b(?:if|while) \(")
CALL = re.compile(r"\s*(?:[\w>\])]+(?:\[[^;]*?\])?(?:::|\.|->))*\w+(?:<[^;()]*>)?\(.*\);\s*$")
ASSIGNMENT = re.compile(r"\s*\*?[A-Za-z_][\w.:]*(?:(?:->|\[[^;=]*\]|\(\))[\w.]*)* (?:[-+*/|&^]|<<|>>)?= .*;\s*$")
STEP = re.compile(r"\s*(?:\+\+|--)[\w.\[\]>-]+;\s*$")
WITHOUT_EFFECT = re.compile(r"(?:\.|->)(?:reserve|shrink_to_fit)\(")
RETURN = re.compile(r"(\s*)return (.+);\s*$")
KEYWORD = re.compile(r"\s*(?:return|if|for|while|switch|case|default|else|do|break|continue|using|delete|new|sizeof|goto)\b")
DEFAULT_VALUES = {"{}", "false", "nullptr", "0", "0.0", "0.0F", "0.0f", "std::nullopt", '""'}


def is_balanced(text):
    return all(text.count(left) == text.count(right) for left, right in ("()", "[]", "{}"))


def operators(code):
    for match in OPERATOR.finditer(code):
        for kind, swap in SWAPS.items():
            if match[0] in swap and not (match[0].startswith("+") and '"' in code):  # which puts strings together
                yield kind, match.start(), match.end(), swap[match[0]]


def truths(code):
    for match in TRUTH.finditer(code):
        yield "truth", match.start(), match.end(), "false" if match[0] == "true" else "true"


def numbers(code):
    if PURE_VIRTUAL.search(code):
        return
    for match in NUMBER.finditer(code):
        text, suffix = match[0].replace("'", ""), match["suffix"]
        digits = text[: len(text) - len(suffix)]
        is_hex = digits[:2] in ("0x", "0X")
        if not is_hex and re.search(r"[.eE]", digits):
            values = [f"({match[0]} + 1)"] if float(digits) == 0 else [f"({match[0]} * 2)", f"({match[0]} + 1)"]
        else:
            value = int(digits, 16 if is_hex else 10)
            form = hex if is_hex else str
            values = [form(other) + suffix for other in sorted({2 * value, value + 1} - {value})]
        for value in values:
            yield "constant", match.start(), match.end(), value


def extremes(code):
    for match in EXTREMUM.finditer(code):
        yield "extremum", match.start(1), match.end(1), "max" if match[1] == "min" else "min"


def negations(code):
    for match in CONDITION.finditer(code):
        start = match.end()
        end = end_of_statement(code, start)
        while end < len(code) and code[end] == ";":  # if (declaration; condition)
            start = end + 1
            end = end_of_statement(code, start)
        start += len(code[start:end]) - len(code[start:end].lstrip())
        is_declaration = re.search(r" = ", code[start:end])
        if end < len(code) and start < end and not is_declaration:
            yield "negation", start, end, f"!({code[start:end].strip()})"


def statements(code, begins):
    """Whole lines: a call or an assignment that goes, a value that is not returned."""
    if not begins or not is_balanced(code) or not code.strip():
        return
    start, end = len(code) - len(code.lstrip()), len(code.rstrip())
    returned = RETURN.match(code)
    if returned:
        value = returned[2]
        if re.search(r"&&|\|\|| [<>=!]=? |^!", value) and "?" not in value:
            yield "returned value", start, end, f"return !({value});"
        elif value not in DEFAULT_VALUES and '"' not in value:
            yield "returned value", start, end, "return {};"
    elif KEYWORD.match(code) or WITHOUT_EFFECT.search(code):
        return
    elif CALL.match(code) or ASSIGNMENT.match(code) or STEP.match(code):
        yield "deletion", start, end, ";"


def begins_statement(lines, index):
    """Whether the code before this line ends a statement or opens a block."""
    for line in reversed(lines[:index]):
        text = line.rstrip()
        if text:
            return text[-1] in ";{}:" or bool(re.search(r"(?:^|\s)(?:else|do)$|^\s*(?:if|for|while) \(.*\)$", text))
    return True


def mutants_of(file, text):
    """All changes of a source, by line."""
    codes, lines = code_of(text).split("\n"), text.split("\n")
    for index, code in enumerate(codes):
        if not code.strip():
            continue
        changes = [change for find in (operators, truths, numbers, extremes, negations) for change in find(code)]
        changes += statements(code, begins_statement(codes, index))
        before = lines[index]
        found = []
        for kind, start, end, new in changes:
            # What is kept comes from the source: the code has blanks for its strings.
            if kind == "negation":
                new = f"!({before[start:end].strip()})"
            elif kind == "returned value" and new != "return {};":
                new = "return !(" + before[start:end].strip()[len("return ") : -1] + ");"
            found.append(Mutant(file, index + 1, kind, before, before[:start] + new + before[end:]))
        if found:
            yield found


def draw(sources, seed):
    """At most one change a line. The order depends on the seed and the line: fewer modules leave that of the others as it is."""

    def lot(mutant):
        text = f"{seed}:{mutant.file}:{mutant.line}:{mutant.before}"
        return int.from_bytes(hashlib.sha256(text.encode()).digest()[:8], "big")

    lines = [found for file, text in sources for found in mutants_of(file, text)]
    lines.sort(key=lambda found: (lot(found[0]), found[0].file, found[0].line))
    return [found[lot(found[0]) % len(found)] for found in lines]


# --- Building and testing ---

TEST = re.compile(r"^(?:TYPED_)?TEST(?:_[FP])?\((\w+),", re.MULTILINE)
NO_TEST = "^$"


def failed_test(output):
    """Of what ctest prints; it lists tests that were skipped before those that fail."""
    failed = re.search(r"^\s+\d+ - (.+) \((?!Skipped|Disabled|Not Run)", output, re.MULTILINE)
    return failed[1] if failed else "ctest fails"


class Project:
    """A copy of the committed tree in a folder of its own, with its build, both kept from call to call."""

    def __init__(self, root, folder, jobs):
        self.root, self.folder, self.jobs = root, folder, jobs
        self.tree, self.build_folder = folder / "tree", folder / "build"
        self.usual_file = folder / "usual.json"
        self.commit = self.git("rev-parse", "HEAD")

    def git(self, *arguments, cwd=None):
        done = subprocess.run(["git", *arguments], cwd=cwd or self.root, check=True, capture_output=True, text=True)
        return done.stdout.strip()

    def prepare(self):
        self.folder.mkdir(parents=True, exist_ok=True)
        if not (self.tree / ".git").exists():
            self.git("worktree", "prune")
            self.git("worktree", "add", "--force", "--detach", str(self.tree), self.commit)
        self.git("checkout", "--force", "--detach", self.commit, cwd=self.tree)
        command = ["cmake", "-S", str(self.tree), "-B", str(self.build_folder), "-G", "Ninja"]
        # An index beyond the end of a container ends the test.
        command.append("-DCMAKE_CXX_FLAGS=-D_GLIBCXX_ASSERTIONS")
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)

    def sources(self, modules):
        patterns = [f"{module}/*.{end}" for module in modules for end in ("cpp", "h")]
        files = self.git("ls-files", "--", *patterns, cwd=self.tree)
        for file in sorted(files.split("\n")):
            if file and not file.startswith(LEFT_OUT):
                yield file, (self.tree / file).read_text()

    def write(self, mutant, line):
        path = self.tree / mutant.file
        lines = path.read_text().split("\n")
        lines[mutant.line - 1] = line
        path.write_text("\n".join(lines))

    def build(self, module):
        """Whether the program of tests builds."""
        command = ["cmake", "--build", str(self.build_folder), "--parallel", str(self.jobs)]
        command += ["--target", f"{module}_tests"]
        with open(self.folder / "build.log", "w") as log:
            return subprocess.run(command, stdout=log, stderr=log).returncode == 0

    def programs(self, module):
        """A hash of what the tests of a module run."""
        total = hashlib.sha256()
        for name in [f"tests/{module}_tests"] + (["apps/scarp"] if module == "apps" else []):
            total.update((self.build_folder / name).read_bytes())
        return total.hexdigest()

    def limit_memory(self):
        """A loop that a change makes endless may not take the machine with it."""
        share = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") // 2
        resource.setrlimit(resource.RLIMIT_AS, (share, share))

    def nearest(self, file):
        """A pattern for the tests of the room of a source: they stand in the folder of the same name below tests."""
        sources = sorted((self.tree / "tests" / file).parent.glob("*_test.cpp"))
        suites = {suite for source in sources for suite in TEST.findall(source.read_text())}
        return f"(^|/)({'|'.join(sorted(suites))})[./]" if suites else NO_TEST

    def test(self, module, limit, first=NO_TEST):
        """The tests of a module without the slow ones: None if all pass, or what failed first.

        Those that the pattern `first` names run first, then the quick ones.
        """
        end = None if limit is None else time.monotonic() + limit
        for choice in (["-R", first], ["-L", "^quick$", "-E", first], ["-LE", "^(quick|slow)$", "-E", first]):
            command = ["ctest", "--test-dir", str(self.build_folder), "-L", f"^{module}$", *choice, "--stop-on-failure"]
            process = subprocess.Popen(
                [*command, "-j", str(self.jobs)],
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                text=True,
                errors="replace",
                start_new_session=True,
                preexec_fn=self.limit_memory,
            )
            try:
                output, _ = process.communicate(timeout=None if end is None else max(end - time.monotonic(), 1))
            except subprocess.TimeoutExpired:
                os.killpg(process.pid, signal.SIGKILL)
                process.wait()
                return "timeout"
            except KeyboardInterrupt:
                os.killpg(process.pid, signal.SIGKILL)
                raise
            if process.returncode != 0:
                return failed_test(output)
        return None

    def usual(self, module):
        """Seconds of the tests, and the hash of the programs, of the code as it is."""
        known = json.loads(self.usual_file.read_text()) if self.usual_file.exists() else {}
        key = f"{self.commit} {module}"
        if key not in known:
            say(f"{module}: building and testing the code as it is")
            if not self.build(module):
                raise SystemExit(f"mutants: {module} does not build: {self.folder}/build.log")
            start = time.monotonic()
            failed = self.test(module, None)
            if failed:
                raise SystemExit(f"mutants: {failed} of {module} fails without any change")
            known[key] = {"seconds": time.monotonic() - start, "programs": self.programs(module)}
            self.usual_file.write_text(json.dumps(known, indent=1))
        return known[key]


def say(line):
    print(line, file=sys.stderr, flush=True)


def judge(project, mutant):
    """What becomes of a change: killed, survived, or one that does not count; and the test that noticed it."""
    module = mutant.file.split("/")[0]
    usual = project.usual(module)
    project.write(mutant, mutant.after)
    try:
        if not project.build(module):
            return "does not compile", ""
        if project.programs(module) == usual["programs"]:
            return "same program", ""
        failed = project.test(module, max(60, 5 * usual["seconds"]), project.nearest(mutant.file))
        return ("killed", failed) if failed else ("survived", "")
    finally:
        project.write(mutant, mutant.before)


def run(project, drawn, count, keep=lambda rows: None):
    """Judges changes until so many count. What is known so far is kept after each: a run takes hours."""
    rows = []
    counted = 0
    for mutant in drawn:
        if counted == count:
            break
        start = time.monotonic()
        result, by = judge(project, mutant)
        counted += result in ("killed", "survived")
        rows.append({**asdict(mutant), "result": result, "by": by, "seconds": round(time.monotonic() - start, 1)})
        keep(rows)
        say(f"{counted}/{count} {mutant.file}:{mutant.line} {mutant.kind}: {result} {by}".rstrip())
    return rows


def table(rows):
    """Counts by module, then the survivors with their lines."""
    results = ["killed", "survived", "does not compile", "same program"]
    text = ["| module | " + " | ".join(results) + " |", "| --- " * 5 + "|"]
    modules = [module for module in MODULES if any(row["file"].startswith(module + "/") for row in rows)]
    for name in [*modules, "all"]:
        of = [row["result"] for row in rows if name == "all" or row["file"].startswith(name + "/")]
        text.append(" | ".join([f"| {name}", *[str(of.count(result)) for result in results]]) + " |")
    for row in rows:
        if row["result"] == "survived":
            text += ["", f"{row['file']}:{row['line']}: {row['kind']}"]
            text += [f"- {row['before'].strip()}", f"+ {row['after'].strip()}"]
    return "\n".join(text)


def read_arguments(arguments):
    parser = argparse.ArgumentParser(prog="./dev mutants", description=__doc__.split("\n", maxsplit=1)[0])
    add = parser.add_argument
    add("count", nargs="?", type=int, default=20, help="changes that are built and tested (default 20)")
    add("--seed", type=int, default=1, help="another seed draws other changes (default 1)")
    add("--only", metavar="MODULE", action="append", choices=MODULES, help="change this module only; repeatable")
    add("--list", action="store_true", help="print the changes that are drawn and test none")
    add("--json", metavar="FILE", type=Path, help="write all changes with their results")
    add("--jobs", type=int, default=os.cpu_count(), help="compilers and tests at once (default: all processors)")
    return parser.parse_args(arguments)


def print_changes(drawn):
    for mutant in drawn:
        print(f"{mutant.file}:{mutant.line}: {mutant.kind}\n- {mutant.before.strip()}\n+ {mutant.after.strip()}")


def main():
    options = read_arguments(sys.argv[1:])
    root = Path(__file__).resolve().parents[2]
    project = Project(root, root / "build" / "mutants", options.jobs)
    project.prepare()
    if project.git("status", "--porcelain"):
        say("mutants: only what is committed is tested")
    drawn = draw(project.sources(options.only or MODULES), options.seed)
    if options.list:
        return print_changes(drawn[: options.count])
    summary = {"commit": project.commit, "seed": options.seed, "modules": options.only or MODULES}

    def write_json(rows):
        if options.json:
            options.json.write_text(json.dumps({**summary, "mutants": rows}, indent=1) + "\n")

    print(table(run(project, drawn, options.count, write_json)))


if __name__ == "__main__":
    main()
