// The command line: reads it, runs one command, turns exceptions into messages and exit codes.

#include <fmt/format.h>

#include <cstdio>
#include <exception>
#include <filesystem>
#include <iostream>
#include <new>
#include <variant>

#include "apps/commands.h"
#include "core/error.h"
#include "core/parallel.h"

namespace scarp {

namespace {

ExitCode run_command_line(int argc, char** argv) {
  const auto read = read_command_line(argc, argv);
  if (const auto* code = std::get_if<ExitCode>(&read)) return *code;
  const CommandLine& line = std::get<CommandLine>(read);
  const ThreadLimit limit(line.common.threads);
  const ExitCode code = std::visit(
      [&line](const auto& arguments) { return execute(arguments, line.common); }, line.command);
  // A result that did not reach its reader is no result.
  if (!std::cout.flush() || std::fflush(stdout) != 0) {
    throw NumericalError("standard output cannot be written");
  }
  return code;
}

}  // namespace

}  // namespace scarp

int main(int argc, char** argv) {
  using namespace scarp;
  try {
    return run_command_line(argc, argv);
  } catch (const InputError& error) {
    fmt::print(stderr, "{}\n", error.what());
    return wrong_input;
  } catch (const NumericalError& error) {
    fmt::print(stderr, "{}\n", error.what());
    return could_not_go_on;
  } catch (const std::filesystem::filesystem_error& error) {
    fmt::print(stderr, "{}: {}\n", error.path1().string(), error.code().message());
    return could_not_go_on;
  } catch (const std::bad_alloc&) {
    fmt::print(stderr, "out of memory; use a coarser spacing or a smaller extent\n");
    return could_not_go_on;
  } catch (const std::exception& error) {
    fmt::print(stderr, "a mistake of scarp, please report it with its input: {}\n", error.what());
    return could_not_go_on;
  }
}
