// How README, docs and the heads of folders read, and whether the files that they name exist. Other
// tests compare the keys of recipes and the names of results with the program: RecipeReference and
// ResultsReference in tests/apps.

#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <vector>

namespace scarp {
namespace {

namespace fs = std::filesystem;

const fs::path root = SCARP_SOURCE_DIR;

bool starts_with(const std::string& text, const std::string& start) {
  return text.rfind(start, 0) == 0;
}

/// What somebody wrote: neither what builds and runs leave, nor what git holds.
std::vector<fs::path> written_files() {
  const std::set<std::string> left_out{"build", "results", "node_modules", ".git"};
  std::vector<fs::path> files;
  fs::recursive_directory_iterator entry(root);
  for (; entry != fs::recursive_directory_iterator(); ++entry) {
    if (left_out.contains(entry->path().filename().string()))
      entry.disable_recursion_pending();
    else if (entry->is_regular_file())
      files.push_back(fs::relative(entry->path(), root));
  }
  std::sort(files.begin(), files.end());
  return files;
}

/// README, docs, and the README of each folder and room.
std::vector<fs::path> pages() {
  std::vector<fs::path> found;
  for (const fs::path& file : written_files())
    if (file.extension() == ".md") found.push_back(file);
  return found;
}

std::vector<std::string> lines_of(const fs::path& file) {
  std::ifstream in(root / file);
  std::vector<std::string> lines;
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

/// The lines of a page, told apart by whether they belong to a block of code.
struct PageLines {
  std::vector<std::string> text, code;  // of equal length; empty where the other is not
};

PageLines page_lines(const fs::path& page) {
  PageLines lines;
  bool is_code = false;
  for (const std::string& line : lines_of(page)) {
    const bool is_fence = starts_with(line, "```");
    lines.text.push_back(is_code || is_fence ? "" : line);
    lines.code.push_back(is_code && !is_fence ? line : "");
    if (is_fence) is_code = !is_code;
  }
  return lines;
}

/// Text as it is read: a picture is left out, a link is its text, a span of code is one word.
std::string as_read(const std::string& text) {
  static const std::regex picture(R"(!\[[^\]]*\]\([^)]*\))");
  static const std::regex code("`[^`]*`");
  static const std::regex link(R"(\[([^\]]*)\]\([^)]*\))");
  std::string read = std::regex_replace(text, picture, "");
  read = std::regex_replace(read, code, "code");
  return std::regex_replace(read, link, "$1");
}

std::vector<std::string> split(const std::string& text, char at) {
  std::vector<std::string> parts;
  std::istringstream in(text);
  for (std::string part; std::getline(in >> std::ws, part, at);) parts.push_back(part);
  return parts;
}

/// Paragraphs, items of lists and cells of tables, each on one line. Headings and code are left
/// out.
std::vector<std::string> paragraphs(const fs::path& page) {
  static const std::regex bullet(R"(^\s*(-|\d+\.) )");
  std::vector<std::string> found{""};
  for (const std::string& line : page_lines(page).text) {
    const bool is_row = starts_with(line, "|");
    const bool is_item = std::regex_search(line, bullet);
    if (line.empty() || is_row || is_item || starts_with(line, "#")) found.emplace_back();
    if (starts_with(line, "#")) continue;
    if (is_row)
      for (const std::string& cell : split(line, '|')) found.push_back(cell);
    else
      found.back() += std::regex_replace(line, bullet, "") + ' ';
  }
  return found;
}

bool is_word(const std::string& text) {
  return std::any_of(text.begin(), text.end(),
                     [](unsigned char c) { return std::isalnum(c) != 0; });
}

/// Whether a sentence ends with this word.
bool ends_sentence(std::string word) {
  while (!word.empty() && std::string(")\"'*").find(word.back()) != std::string::npos)
    word.pop_back();
  if (word.empty() || std::string(".!?").find(word.back()) == std::string::npos) return false;
  const std::set<std::string> abbreviations{"al.", "Fig.", "No.", "e.g.", "i.e.", "vs."};
  const bool is_initial =
      word.size() == 2 && std::isupper(static_cast<unsigned char>(word[0])) != 0;
  return !is_initial && !abbreviations.contains(word);
}

/// The sentences of a paragraph, each as its words. A list of keys counts as one word.
std::vector<std::vector<std::string>> sentences(const std::string& paragraph) {
  std::vector<std::vector<std::string>> found(1);
  std::istringstream in(as_read(paragraph));
  for (std::string word; in >> word;) {
    std::vector<std::string>& last = found.back();
    const bool goes_on_listing = !last.empty() && word == "code," && last.back() == word;
    if (is_word(word) && !goes_on_listing) last.push_back(word);
    if (!last.empty() && ends_sentence(word)) found.emplace_back();
  }
  if (found.back().empty()) found.pop_back();
  return found;
}

std::string joined(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += word + ' ';
  return text;
}

// Cells count where they are sentences, not names and numbers.
TEST(Words, SentencesAreShort) {
  constexpr std::size_t most_words = 30, least_words_of_sentence = 5;
  int all = 0;
  std::vector<std::string> too_long;
  for (const fs::path& page : pages()) {
    for (const std::string& paragraph : paragraphs(page)) {
      for (const std::vector<std::string>& sentence : sentences(paragraph)) {
        if (sentence.size() >= least_words_of_sentence) ++all;
        if (sentence.size() > most_words)
          too_long.push_back(page.string() + ": " + joined(sentence));
      }
    }
  }
  ASSERT_GT(all, 500) << "hardly a sentence was read: the test looks in the wrong place";
  std::string list;
  for (const std::string& sentence : too_long) list += sentence + '\n';
  EXPECT_LT(static_cast<double>(too_long.size()), 0.02 * all) << list;
}

// English that has to be read twice, and words of this project alone; never an everyday word.
const std::vector<std::string>& private_phrases() {
  static const std::vector<std::string> phrases = split(
      "hangs on, hang on, hung on, hangs from, is told of, are told of, tells of, told of, "
      "goes first, go first, where the vertex goes, for how much, dear flux, dear edges, owed, "
      "owes to, stands still, stand still, stood still, comes to light, come to light, "
      "came to light, turning speeds, turns with the normal, turn with the normal, brightness, "
      "flights, for one's own, as it is, beside what, dug, eaten, off by, is off, are off, "
      "further off, farther off, let go, laid bare, comes to be, taken anew, made anew, "
      "solved anew, gone on with, to be said, within one another, is told, are told, tell of, "
      "goes on from, go on from, one's own, what there is, of above",
      ',');
  return phrases;
}

std::string lower(std::string text) {
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

bool is_letter(char c) { return std::isalpha(static_cast<unsigned char>(c)) != 0; }

/// Whether a text holds a phrase, between other words.
bool holds(const std::string& text, const std::string& phrase) {
  for (std::size_t at = 0; (at = text.find(phrase, at)) != std::string::npos; ++at) {
    const std::size_t end = at + phrase.size();
    if ((at == 0 || !is_letter(text[at - 1])) && (end == text.size() || !is_letter(text[end])))
      return true;
  }
  return false;
}

void expect_plain(const std::string& place, const std::string& text) {
  const std::string read = lower(text);
  for (const std::string& phrase : private_phrases())
    EXPECT_FALSE(holds(read, phrase)) << place << ": \"" << phrase << "\" in: " << text;
}

TEST(Words, PagesHaveNoPrivatePhrase) {
  for (const fs::path& page : pages())
    for (const std::string& paragraph : paragraphs(page))
      for (const std::vector<std::string>& sentence : sentences(paragraph))
        expect_plain(page.string(), joined(sentence));
}

/// The texts in the sources of the program: help, messages, pages of models. Those that stand side
/// by side are one, as the compiler has them.
std::vector<std::string> texts_in(const fs::path& source) {
  // A comment, a character, a raw text, a text, or anything else that is no blank.
  static const std::regex token(
      R"re(//[^\n]*|'(\\.|[^'\\\n])'|R"\w*\(|"((?:\\.|[^"\\\n])*)"|[A-Za-z0-9_']+|\S)re");
  std::vector<std::string> found;
  bool goes_on = false;
  for (const std::string& line : lines_of(source)) {
    if (starts_with(line, "#")) continue;
    for (std::sregex_iterator match(line.begin(), line.end(), token), end; match != end; ++match) {
      const bool is_text = (*match)[2].matched;
      const bool is_comment = starts_with((*match)[0], "//");
      if (is_text && !goes_on) found.emplace_back();
      if (is_text) found.back() += (*match)[2];
      if (!is_comment) goes_on = is_text;
    }
  }
  return found;
}

TEST(Words, MessagesHaveNoPrivatePhrase) {
  const std::set<std::string> folders{"apps", "core", "levelset", "mesh", "flux", "models"};
  int texts = 0;
  for (const fs::path& file : written_files()) {
    if (file.extension() != ".cpp" && file.extension() != ".h") continue;
    if (!folders.contains(file.begin()->string())) continue;
    for (const std::string& text : texts_in(file)) {
      ++texts;
      expect_plain(file.string(), text);
    }
  }
  EXPECT_GT(texts, 2000);
}

/// The comments of a recipe as one text.
std::string comments_of(const fs::path& recipe) {
  std::string text;
  for (const std::string& line : lines_of(recipe)) {
    const std::size_t at = line.find('#');
    if (at == std::string::npos) continue;
    std::istringstream in(line.substr(at + 1));
    for (std::string word; in >> word;) text += word + ' ';
  }
  return text;
}

TEST(Words, RecipesHaveNoPrivatePhrase) {
  int recipes = 0;
  for (const fs::directory_entry& entry : fs::directory_iterator(root / "configs")) {
    const fs::path recipe = fs::relative(entry.path(), root);
    expect_plain(recipe.string(), comments_of(recipe));
    ++recipes;
  }
  EXPECT_GT(recipes, 20);
}

/// How many characters a line of UTF-8 has.
std::size_t length_of(const std::string& line) {
  return static_cast<std::size_t>(std::count_if(line.begin(), line.end(), [](char c) {
    return (static_cast<unsigned char>(c) & 0xC0U) != 0x80U;
  }));
}

/// Sources, scripts and pages; not what tests read, nor what tools write.
bool has_lines_for_people(const fs::path& file) {
  const std::string name = file.string();
  for (const char* data : {"tests/reference/", "tests/fuzz/seeds/", "tests/fuzz/found/"})
    if (starts_with(name, data)) return false;
  if (name == "tests/apps/user_errors.toml") return false;  // messages as they are printed
  if (name.find(".min.") != std::string::npos) return false;
  static const std::set<std::string> endings{".cpp", ".h",  ".md",  ".toml", ".txt",
                                             ".py",  ".js", ".mjs", ".cmake"};
  const bool is_script = starts_with(name, "tests/faults/") ||
                         starts_with(name, "tests/determinism/") || name == "dev" ||
                         name == ".ci/run";
  return endings.contains(file.extension().string()) || is_script;
}

TEST(Words, LinesAreAtMost130CharactersLong) {
  int files = 0;
  for (const fs::path& file : written_files()) {
    if (!has_lines_for_people(file)) continue;
    ++files;
    int number = 0;
    for (const std::string& line : lines_of(file)) {
      ++number;
      const bool is_row = starts_with(line, "|") || line.find(" | ") != line.rfind(" | ");
      const bool is_link =
          line.find("](") != std::string::npos || line.find("://") != std::string::npos;
      if (is_row || is_link) continue;
      EXPECT_LE(length_of(line), 130U) << file.string() << ':' << number << ": " << line;
    }
  }
  EXPECT_GT(files, 500);
}

TEST(Words, ReadmeAndChangelogAreShort) {
  EXPECT_LE(lines_of("README.md").size(), 130U);
  EXPECT_LE(lines_of("CHANGELOG.md").size(), 60U);
}

/// Headings as links name them: "Where it is measured" is where-it-is-measured.
std::set<std::string> anchors(const fs::path& page) {
  std::set<std::string> found;
  for (const std::string& line : page_lines(page).text) {
    if (!starts_with(line, "#")) continue;
    std::string anchor;
    for (const char c : lower(line.substr(line.find(' ') + 1))) {
      if (c == ' ') anchor += '-';
      if (c == '-' || c == '_' || is_letter(c) || std::isdigit(static_cast<unsigned char>(c)) != 0)
        anchor += c;
    }
    found.insert(anchor);
  }
  return found;
}

/// All that a pattern finds in a text.
std::vector<std::string> matches(const std::string& text, const std::regex& pattern) {
  std::vector<std::string> found;
  for (std::sregex_iterator match(text.begin(), text.end(), pattern), end; match != end; ++match)
    found.push_back((*match)[1]);
  return found;
}

void expect_link(const fs::path& page, const std::string& link) {
  const std::size_t mark = std::min(link.find('#'), link.size());
  const std::string file = link.substr(0, mark);
  const fs::path target = file.empty() ? page : (page.parent_path() / file).lexically_normal();
  EXPECT_TRUE(fs::exists(root / target)) << page.string() << " links to " << link;
  if (mark == link.size() || !fs::exists(root / target)) return;
  EXPECT_TRUE(anchors(target).contains(link.substr(mark + 1)))
      << page.string() << ": no such heading: " << link;
}

TEST(Words, LinksLeadSomewhere) {
  int links = 0;
  for (const fs::path& page : pages()) {
    for (const std::string& line : page_lines(page).text) {
      for (const std::string& link : matches(line, std::regex(R"(\]\(([^)\s]+)\))"))) {
        if (link.find("://") != std::string::npos) continue;
        ++links;
        expect_link(page, link);
      }
    }
  }
  EXPECT_GT(links, 50);
}

std::set<std::string> top_folders() {
  std::set<std::string> names;
  for (const fs::directory_entry& entry : fs::directory_iterator(root))
    if (entry.is_directory()) names.insert(entry.path().filename().string());
  for (const char* made : {"build", "results"}) names.erase(made);
  return names;
}

/// Files as pages name them, from the top of the project, from the folder of the page, or alone.
class NamedFiles {
 public:
  /// A path into the project or a name with the ending of a source; not NAME.toml, which stands
  /// for any.
  bool is_file_name(const std::string& word) const {
    static const std::regex placeholder("NAME|FOLDER|ROOM|[*<>$]");
    if (std::regex_search(word, placeholder)) return false;
    const std::size_t slash = word.find('/');
    if (slash != std::string::npos) return folders_.contains(word.substr(0, slash));
    static const std::set<std::string> endings{".cpp", ".h", ".md", ".cmake", ".mjs"};
    return endings.contains(fs::path(word).extension().string());
  }

  bool exists(const fs::path& page, const std::string& word) const {
    if (fs::exists(root / word) || fs::exists(root / page.parent_path() / word)) return true;
    return word.find('/') == std::string::npos && names_.contains(word);
  }

 private:
  static std::set<std::string> names_of(const std::vector<fs::path>& files) {
    std::set<std::string> names;
    for (const fs::path& file : files) names.insert(file.filename().string());
    return names;
  }

  std::set<std::string> folders_ = top_folders();
  std::set<std::string> names_ = names_of(written_files());
};

TEST(Words, FilesThatPagesNameExist) {
  const NamedFiles named;
  const std::regex code_span("`([^`]+)`");
  const std::regex path(R"(([A-Za-z0-9_.][A-Za-z0-9_./*<>-]*[A-Za-z0-9_*>]))");
  int files = 0;
  for (const fs::path& page : pages()) {
    const PageLines lines = page_lines(page);
    std::vector<std::string> code = lines.code;
    for (const std::string& line : lines.text)
      for (const std::string& span : matches(line, code_span)) code.push_back(span);
    for (const std::string& text : code) {
      for (const std::string& word : matches(text, path)) {
        if (!named.is_file_name(word)) continue;
        ++files;
        EXPECT_TRUE(named.exists(page, word)) << page.string() << " names " << word;
      }
    }
  }
  EXPECT_GT(files, 100);
}

TEST(Words, PagesThatSourcesNameExist) {
  int named = 0;
  for (const fs::path& file : written_files()) {
    const std::string ending = file.extension().string();
    if (ending != ".cpp" && ending != ".h" && ending != ".js") continue;
    for (const std::string& line : lines_of(file)) {
      if (line.find("docs/") == std::string::npos) continue;
      for (const std::string& page : matches(line, std::regex(R"((docs/[a-z_]+\.md))"))) {
        ++named;
        EXPECT_TRUE(fs::exists(root / page)) << file.string() << " names " << page;
      }
    }
  }
  EXPECT_GT(named, 5);
}

TEST(Words, EachFolderWithSourcesHasAReadme) {
  std::set<fs::path> folders;
  for (const fs::path& file : written_files()) {
    const std::string top = file.begin()->string();
    const std::string ending = file.extension().string();
    const bool is_source = ending == ".cpp" || ending == ".h" || ending == ".js";
    if (!is_source || top == "tests" || top == "cmake") continue;
    const fs::path folder = file.parent_path();
    const bool is_room = std::distance(folder.begin(), folder.end()) <= 2;
    if (is_room) folders.insert(folder);
  }
  EXPECT_GT(folders.size(), 15U);
  for (const fs::path& folder : folders)
    EXPECT_TRUE(fs::exists(root / folder / "README.md")) << folder.string();
}

}  // namespace
}  // namespace scarp
