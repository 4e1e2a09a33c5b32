#!/usr/bin/env python3
"""What mutants.py changes in a source, what it leaves alone, and what it makes of builds and tests."""

import sys
import tempfile
import unittest
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
import mutants  # noqa: E402


def changes(text):
    """All changes of a text as pairs of kind and new line."""
    return [(mutant.kind, mutant.after.strip()) for line in mutants.mutants_of("core/a.cpp", text) for mutant in line]


def new_lines(text):
    return {after for _, after in changes(text)}


class Changes(unittest.TestCase):
    def test_operators_become_their_neighbours(self):
        self.assertEqual(new_lines("  if (a < b) stop = c;"), {"if (a <= b) stop = c;", "if (!(a < b)) stop = c;"})
        self.assertIn(("comparison", "x = a != b;"), changes("  x = a == b;"))
        self.assertIn(("arithmetic", "x -= a * b;"), changes("  x += a * b;"))
        self.assertIn(("arithmetic", "x += a / b;"), changes("  x += a * b;"))
        self.assertIn(("logic", "is_done = a ||"), changes("  is_done = a &&"))

    def test_truths_numbers_and_extremes(self):
        self.assertIn(("truth", "bool is_open = true;"), changes("bool is_open = false;"))
        self.assertEqual(new_lines("double w = 0.5F;"), {"double w = (0.5F * 2);", "double w = (0.5F + 1);"})
        self.assertEqual(new_lines("int n = 1'000U;"), {"int n = 2000U;", "int n = 1001U;"})
        self.assertEqual(new_lines("int n = 0x10;"), {"int n = 0x20;", "int n = 0x11;"})
        self.assertEqual(new_lines("int n = 0;"), {"int n = 1;"})
        self.assertEqual(new_lines("int n = 1;"), {"int n = 2;"})
        self.assertIn(("extremum", "x = std::max(a, b);"), changes("  x = std::min(a, b);"))

    def test_conditions_are_negated_without_their_declaration(self):
        self.assertEqual(new_lines("while (f(a)) {"), {"while (!(f(a))) {"})
        self.assertEqual(new_lines("if (int i = f(); i) {"), {"if (int i = f(); !(i)) {"})
        self.assertEqual(new_lines("if (const auto i = f()) {"), set())

    def test_statements_are_deleted(self):
        for line in ("run(a, b)", "x.y->run(a)", "std::sort(a)", "x = a", "x[i] += a", "*p = a", "f(a).g()", "++x"):
            self.assertIn(("deletion", ";"), changes("{\n  " + line + ";\n}"), line)
        for line in ("int x = a", "auto y(a)", "const T& z = f(a)", "break", "a.reserve(b)", "std::vector<int> x(a)"):
            self.assertNotIn(("deletion", ";"), changes("{\n  " + line + ";\n}"), line)

    def test_a_statement_of_many_lines_stays(self):
        self.assertNotIn(("deletion", ";"), changes("x =\n  f(a);"))

    def test_returned_values_are_others(self):
        self.assertEqual(new_lines("return result;"), {"return {};"})
        self.assertIn("return !(a && b);", new_lines("return a && b;"))
        self.assertEqual(new_lines("return {};"), set())

    def test_the_words_of_a_source_stay(self):
        for text in (
            "// a < b && true 1",
            "/* a < b\n true */",
            'name("a < b true 1")',
            "R\"(a < b\n true)\"",
            "#if A < 1",
            "#define A(b) \\\n  b + 1",
            "static_assert(a < 1);",
            "throw InputError(place, a < 1 ?\n  b : 2);",
            'fmt::format("{}", a + 1)',
            "log.warn(text(1));",
            "template <int n, bool b = true>",
            "virtual double rate() const = 0;",
            "std::vector<float>&& x",
            "std::get<0>(x)",
            "Vec3d r;",
        ):
            self.assertEqual(new_lines(text), set(), text)

    def test_a_condition_before_a_message_is_code(self):
        after = {"if (a <= b) throw InputError(1);", "if (!(a < b)) throw InputError(1);"}
        self.assertEqual(new_lines("if (a < b) throw InputError(1);"), after)

    def test_what_is_not_changed_stays_to_the_letter(self):
        line = "  if (name == \"a < b\") run('\\'', 1);  // two"
        for mutant in [mutant for found in mutants.mutants_of("core/a.cpp", line) for mutant in found]:
            self.assertTrue(mutant.after.endswith("// two") and '"a < b"' in mutant.after and "'\\''" in mutant.after)


class Draw(unittest.TestCase):
    SOURCES = [(f"{module}/a.cpp", "\n".join(f"x{i} = a + b;" for i in range(20))) for module in ("core", "mesh")]

    def test_depends_on_the_seed_only(self):
        self.assertEqual(mutants.draw(self.SOURCES, 1), mutants.draw(reversed(self.SOURCES), 1))
        self.assertNotEqual(mutants.draw(self.SOURCES, 1), mutants.draw(self.SOURCES, 2))

    def test_of_a_module_is_part_of_that_of_all(self):
        of_all = [mutant for mutant in mutants.draw(self.SOURCES, 1) if mutant.file.startswith("mesh/")]
        self.assertEqual(mutants.draw(self.SOURCES[1:], 1), of_all)

    def test_changes_a_line_once(self):
        drawn = mutants.draw(self.SOURCES, 1)
        self.assertEqual(len({(mutant.file, mutant.line) for mutant in drawn}), 40)


class FakeProject(mutants.Project):
    """One source whose build and tests are rules about its text."""

    SOURCE = "\n".join(["int x = 2;", "bool is_open = a && b;", "x = std::min(a, b);", "x = a * b;"])

    def __init__(self, folder):
        self.tree = folder
        (folder / "core").mkdir()
        (folder / "core" / "a.cpp").write_text(self.SOURCE)

    def text(self):
        return (self.tree / "core" / "a.cpp").read_text()

    def build(self, module):
        return "a / b" not in self.text()

    def programs(self, module):
        return self.text().replace("||", "&&")

    def test(self, module, limit, first):
        return "A.Test" if "min" not in self.text() else None

    def usual(self, module):
        return {"seconds": 1, "programs": self.SOURCE}


class Verdicts(unittest.TestCase):
    def verdict(self, line, after):
        with tempfile.TemporaryDirectory() as folder:
            project = FakeProject(Path(folder))
            before = FakeProject.SOURCE.split("\n")[line - 1]
            result = mutants.judge(project, mutants.Mutant("core/a.cpp", line, "kind", before, after))
            self.assertEqual(project.text(), FakeProject.SOURCE)
            return result

    def test_say_what_builds_and_tests_say(self):
        self.assertEqual(self.verdict(1, "int x = 3;"), ("survived", ""))
        self.assertEqual(self.verdict(2, "bool is_open = a || b;"), ("same program", ""))
        self.assertEqual(self.verdict(3, "x = std::max(a, b);"), ("killed", "A.Test"))
        self.assertEqual(self.verdict(4, "x = a / b;"), ("does not compile", ""))

    def test_only_killed_and_survived_count(self):
        with tempfile.TemporaryDirectory() as folder:
            project = FakeProject(Path(folder))
            lines = FakeProject.SOURCE.split("\n")
            after = ["int x = 3;", "bool is_open = a || b;", "x = std::max(a, b);", "x = a / b;"]
            drawn = [mutants.Mutant("core/a.cpp", i + 1, "kind", lines[i], after[i]) for i in (3, 1, 0, 2, 0)]
            mutants.say = lambda line: None
            rows = mutants.run(project, drawn, 2)
        self.assertEqual([row["result"] for row in rows], ["does not compile", "same program", "survived", "killed"])
        self.assertIn("core/a.cpp:1: kind\n- int x = 2;\n+ int x = 3;", mutants.table(rows))


class FailedTest(unittest.TestCase):
    def test_is_none_that_was_skipped(self):
        listed = "The following tests {}:\n\t"
        output = listed.format("did not run") + "12 - A.NeedsAViewer (Skipped)\n\n" + listed.format("FAILED")
        self.assertEqual(mutants.failed_test(output + "7 - B.Holds/0 (Failed)\n"), "B.Holds/0")
        self.assertEqual(mutants.failed_test("B.Holds"), "ctest fails")


class Nearest(unittest.TestCase):
    def test_tests_are_those_of_the_same_room(self):
        with tempfile.TemporaryDirectory() as folder:
            project = mutants.Project.__new__(mutants.Project)
            project.tree = Path(folder)
            room = project.tree / "tests" / "mesh" / "files"
            room.mkdir(parents=True)
            (room / "b_test.cpp").write_text("TEST(Two, Holds) {}\nTEST_P(Three, Holds) {}\nTYPED_TEST(Four, Holds) {}")
            (room.parent / "a_test.cpp").write_text("TEST_F(One, Holds) {}")
            self.assertEqual(project.nearest("mesh/files/read.cpp"), "(^|/)(Four|Three|Two)[./]")
            self.assertEqual(project.nearest("mesh/a.h"), "(^|/)(One)[./]")
            self.assertEqual(project.nearest("mesh/none/a.h"), mutants.NO_TEST)


if __name__ == "__main__":
    unittest.main()
