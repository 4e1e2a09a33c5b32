// The command line: reads it, runs one command, turns exceptions into messages and exit codes.

#include <fcntl.h>
#include <unistd.h>

#include <cstdio>
#include <exception>
#include <filesystem>
#include <iostream>
#include <new>
#include <nlohmann/json.hpp>
#include <string>
#include <variant>

#include "apps/commands.h"
#include "core/error.h"
#include "core/parallel.h"

namespace scarp {

namespace {

// Names of files and titles go into JSON and TOML, which hold UTF-8 only.
void require_utf8(const std::string& argument) {
  try {
    static_cast<void>(nlohmann::json(argument).dump());
  } catch (const nlohmann::json::exception&) {
    throw InputError("an argument is not UTF-8: rename the file");
  }
}

ExitCode run_command_line(int argc, char** argv) {
  for (int n = 1; n < argc; ++n) require_utf8(argv[n]);
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

// Never throws, unlike print: that would end the process without its exit code.
void tell(const std::string& text) { std::fputs((text + '\n').c_str(), stderr); }

// A file that is opened must not get the number of a standard stream that was closed.
void open_standard_streams() {
  for (int stream = open("/dev/null", O_RDWR); stream >= 0; stream = dup(stream)) {
    if (stream <= STDERR_FILENO) continue;
    close(stream);
    return;
  }
}

}  // namespace

}  // namespace scarp

int main(int argc, char** argv) {
  using namespace scarp;
  open_standard_streams();
  try {
    return run_command_line(argc, argv);
  } catch (const InputError& error) {
    tell(error.what());
    return wrong_input;
  } catch (const NumericalError& error) {
    tell(error.what());
    return could_not_go_on;
  } catch (const std::filesystem::filesystem_error& error) {
    tell(error.path1().string() + ": " + error.code().message());
    return could_not_go_on;
  } catch (const std::bad_alloc&) {
    tell("out of memory; use a coarser spacing or a smaller extent");
    return could_not_go_on;
  } catch (const std::exception& error) {
    tell(std::string("a mistake of scarp, please report it with its input: ") + error.what());
    return could_not_go_on;
  }
}
