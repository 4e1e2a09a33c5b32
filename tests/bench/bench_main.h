#pragma once

#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <exception>
#include <filesystem>
#include <string>
#include <vector>

#include "core/system/huge_pages.h"

namespace scarp::bench {

/// Adds the names of cases to run. all: cases with a name each.
template <class Cases>
void add_cases(CLI::App& app, const Cases& all, std::vector<std::string>& wanted) {
  std::vector<std::string> names;
  for (const auto& each : all) names.push_back(each.name);
  app.add_option("cases", wanted, "Cases; all without any")->check(CLI::IsMember(names));
}

/// The main function of a benchmark: declare(app) adds its options, run() is called once they are
/// read. What fails is told, with exit code 2.
template <class Declare, class Run>
int bench_main(int argc, char** argv, const std::string& title, const Declare& declare,
               const Run& run) {
  keep_freed_memory();  // as the program does
  try {
    CLI::App app{title};
    declare(app);
    try {
      app.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
      return app.exit(error) == 0 ? 0 : 2;
    }
    run();
    return 0;
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}: {}\n", std::filesystem::path(argv[0]).stem().string(), error.what());
    return 2;
  }
}

}  // namespace scarp::bench
