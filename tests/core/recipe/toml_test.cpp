#include "core/recipe/toml.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"

namespace scarp {
namespace {

TEST(Toml, KeepsTheOrderOfTheFileAndThePlaceOfEverything) {
  const TomlValue root = parse_toml("z = 1\na = [\"x\",\n  true]\n[m]\nb = 1.5\n", "r.toml");
  ASSERT_EQ(root.entries.size(), 3U);
  EXPECT_EQ(root.entries[0].key, "z");
  EXPECT_EQ(root.entries[1].key, "a");
  const TomlValue& list = root.entries[1];
  EXPECT_EQ(list.kind, TomlValue::Kind::list);
  EXPECT_EQ(list.entries[0].text, "x");
  EXPECT_TRUE(list.entries[1].flag);
  EXPECT_EQ(list.entries[1].place.line, 3U);
  EXPECT_EQ(list.entries[1].place.column, 3U);
  const TomlValue* const inner = root.find("m");
  ASSERT_NE(inner, nullptr);
  EXPECT_EQ(inner->place.line, 4U);
  EXPECT_EQ(inner->entries[0].key_place.line, 5U);
  EXPECT_EQ(inner->find("b")->decimal, 1.5);
  EXPECT_EQ(root.find("none"), nullptr);
}

TEST(Toml, TablesThatOnlyTheirPartsNameHaveAPlaceToo) {
  const TomlValue root = parse_toml("x = 1\n[a.b]\nc = 1\n\n[d]\ne.f = 2\n", "r.toml");
  EXPECT_EQ(root.find("a")->place.line, 2U);
  EXPECT_EQ(root.find("d")->find("e")->place.line, 6U);
}

std::string repeated(const std::string& text, int count) {
  std::string all;
  for (int n = 0; n < count; ++n) all += text;
  return all;
}

TEST(Toml, NestingWithoutEndIsRefusedWithItsPlace) {
  const std::string header = "x = \"\"\"[[[ \\\" '\"\"\" # {{{{\n";
  for (const std::string& text :
       {'[' + repeated("a.", 100'000) + "a]", repeated("\"a\" . ", 100'000) + "a = 1",
        "a = " + repeated("[", 100'000), "a = " + repeated("{a=", 100'000)}) {
    EXPECT_THAT([&] { parse_toml(header + text, "r.toml"); },
                testing::ThrowsMessage<InputError>(testing::AllOf(
                    testing::StartsWith("r.toml:2:"), testing::HasSubstr("more than 32 levels"))));
  }
}

TEST(Toml, NamesTheBracketThatIsTooDeep) {
  const std::string deep = "a = 1\nb = " + std::string(max_toml_depth + 3, '[');
  EXPECT_THAT([&] { parse_toml(deep, "r.toml"); },
              testing::ThrowsMessage<InputError>(testing::StartsWith("r.toml:2:37: ")));
}

TEST(Toml, DotsAndBracketsThatDoNotNestAreNotCounted) {
  const std::string text = "a = [" + repeated("1.5, {b=[1.5]}, ", 100) + "]\nb = '" +
                           repeated("[.", 100) + "'\nc = \"\\\"" + repeated("[.", 100) + "\" # " +
                           repeated("[.", 100) + "\n" + repeated("[[d.e]]\n", 100);
  EXPECT_EQ(parse_toml(text, "r").entries.size(), 4U);
}

TEST(Toml, SaysWhatToDoAboutAFault) {
  const auto expect = [](const std::string& text, const std::string& remedy) {
    EXPECT_THAT([&] { parse_toml(text, "r.toml"); },
                testing::ThrowsMessage<InputError>(testing::HasSubstr(remedy)))
        << text;
  };
  expect("a = 1\nspacing = 10 nm\n", "stand in quotes: spacing = \"10 nm\"");
  expect("title = hello # so\n", "stand in quotes: title = \"hello\"");
  expect("title = 'hello\n", "is a quote missing at the end of a text?");
  expect("title = \u201chello\u201d\n", "texts stand in straight quotes");
  expect("a = true;\n", "a line ends without ;");
  expect("a = .5\n", "write 0.5");
  expect("a == 1\n", "a line is key = value");
  expect("// so\n", "comments begin with #");
  expect("title = \"h\xe9\"\n", "save the file as UTF-8");
  expect("title = \"hello\n", "is a quote missing at the end of a text?");
  expect("[domain\n", "a line with the name of a table is [name] or [[name]]");
  expect("spacing\n", "a line is key = value");
  expect("spacing =\n", "a value is missing behind the =");
}

TEST(Toml, CountsColumnsInCharacters) {
  EXPECT_EQ(parse_toml("a = { \"\u00b5\" = 1, b = 2 }", "r").find("a")->entries[1].key_place.column,
            16U);
}

TEST(Toml, WritesValuesThatReadTheSame) {
  const std::string text =
      R"({ a = [1, -2.5, 1e300, "x\"\\\n\t\u0001"], "b c" = true, d = { e = 1.0 } })";
  const TomlValue value = *parse_toml("v = " + text, "r").find("v");
  EXPECT_EQ(format_toml(value), text);
}

TEST(Toml, DescribesValuesInWords) {
  const TomlValue root = parse_toml("a = []\nb = {}\nc = 12:00:00\nd = nan\ne = -inf\n", "r");
  EXPECT_EQ(described(*root.find("a")), "a list");
  EXPECT_EQ(described(*root.find("b")), "a table");
  EXPECT_EQ(described(*root.find("c")), "a date or a time of day");
  EXPECT_EQ(described(*root.find("d")), "nan");
  EXPECT_EQ(described(*root.find("e")), "-inf");
}

}  // namespace
}  // namespace scarp
