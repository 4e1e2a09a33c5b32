// Takes the place of libFuzzer where it is not there: every file of the folders once, and pieces
// and mutations of each, always the same ones.
//
//   fuzz_NAME FOLDER...

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <string>
#include <vector>

#include "core/random.h"
#include "core/system/read_file.h"
#include "tests/fuzz/target.h"

namespace scarp::fuzz {
namespace {

constexpr std::uint64_t mutations_of_each = 200;

void run(const std::string& input) {
  LLVMFuzzerTestOneInput(reinterpret_cast<const std::uint8_t*>(input.data()), input.size());
}

// Cut short, bytes changed, a part put elsewhere.
std::string mutated(std::string input, RandomStream random) {
  const auto place = [&] { return input.empty() ? 0 : random.bits() % input.size(); };
  for (std::uint32_t change = random.bits() % 4; change > 0 && !input.empty(); --change)
    input[place()] = static_cast<char>(random.bits());
  if (random.bits() % 4 == 0) input.resize(place());
  if (random.bits() % 4 == 0) input.insert(place(), input.substr(place(), random.bits() % 64));
  return input;
}

int replay(const std::vector<std::string>& folders) {
  std::vector<std::filesystem::path> files;
  for (const std::string& folder : folders)
    if (std::filesystem::exists(folder))
      for (const auto& entry : std::filesystem::directory_iterator(folder))
        files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  for (std::uint64_t n = 0; n < files.size(); ++n) {
    const std::string input = read_file(files[n]);
    std::printf("%s\n", files[n].c_str());
    std::fflush(stdout);
    run(input);
    for (std::uint64_t k = 0; k < mutations_of_each; ++k) {
      RandomStream random({.ray = n * mutations_of_each + k});
      run(mutated(input, random));
    }
  }
  if (files.empty()) std::printf("no inputs\n");
  return files.empty() ? 1 : 0;
}

}  // namespace
}  // namespace scarp::fuzz

int main(int argc, char** argv) { return scarp::fuzz::replay({argv + 1, argv + argc}); }
