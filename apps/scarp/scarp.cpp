// The command line: reads it, runs one command, turns exceptions into messages and exit codes.

#include <fcntl.h>
#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <iostream>
#include <new>
#include <nlohmann/json.hpp>
#include <string>
#include <system_error>
#include <variant>

#include "apps/run/tell.h"
#include "apps/scarp/commands.h"
#include "core/error.h"
#include "core/parallel.h"
#include "core/printable.h"
#include "core/system/huge_pages.h"
#include "flux/rays/embree_tree.h"

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

// Help and the version are given while the command line is read.
ExitCode read_and_execute(int argc, char** argv) {
  const auto read = read_command_line(argc, argv);
  if (const auto* code = std::get_if<ExitCode>(&read)) return *code;
  const CommandLine& line = std::get<CommandLine>(read);
  const ThreadLimit limit(line.common.threads);
  return std::visit([&line](const auto& arguments) { return execute(arguments, line.common); },
                    line.command);
}

ExitCode run_command_line(int argc, char** argv) {
  for (int n = 1; n < argc; ++n) require_utf8(argv[n]);
  static_cast<void>(embree_configuration());  // refused before there is anything to lose
  const ExitCode code = read_and_execute(argc, argv);
  // A result that did not reach its reader is no result.
  if (!std::cout.flush() || std::fflush(stdout) != 0) {
    throw NumericalError("standard output cannot be written");
  }
  return code;
}

// A file that is opened must not get the number of a standard stream that was closed.
void open_standard_streams() {
  for (int stream = open("/dev/null", O_RDWR); stream >= 0; stream = dup(stream)) {
    if (stream <= STDERR_FILENO) continue;
    close(stream);
    return;
  }
}

constexpr const char* no_threads =
    "the system gives no more threads: raise the limit on memory (ulimit -v) or on processes "
    "(ulimit -u), or use fewer --threads";

/// The thread library says it by a plain error.
bool is_lack_of_threads(const std::exception& error) {
  return std::string(error.what()).find("pthread_create") != std::string::npos;
}

std::string mistake_text(const std::exception& error) {
  return std::string("a mistake of scarp, please report it with its input: ") + error.what();
}

/// Says so on standard error.
ExitCode fail(ExitCode code, const std::string& text) {
  tell(printable(text) + '\n');
  return code;
}

/// Of an exception that does not come to main().
[[noreturn]] void fail_elsewhere() {
  try {
    if (const auto error = std::current_exception()) std::rethrow_exception(error);
  } catch (const std::system_error&) {
    _exit(fail(could_not_go_on, no_threads));
  } catch (const std::exception& error) {
    fail(could_not_go_on, mistake_text(error));
  }
  std::abort();
}

void expect_failures_and_signals() {
  std::set_terminate(fail_elsewhere);
  // Asks a run for a checkpoint; until it listens there is nothing to save.
  std::signal(SIGUSR1, SIG_IGN);
}

// What OpenVDB needs makes threads as it is loaded: only what stands here is called before.
[[gnu::used,
  gnu::section(".preinit_array")]] void (*const before_libraries)() = expect_failures_and_signals;

/// Of those that this program is compiled for, a set that the processor does not have; or nothing.
const char* missing_instructions() {
#ifdef __SSE4_2__
  if (__builtin_cpu_supports("sse4.2") == 0) return "SSE4.2";
#endif
#ifdef __AVX2__
  if (__builtin_cpu_supports("avx2") == 0) return "AVX2";
#endif
#ifdef __AVX512F__
  if (__builtin_cpu_supports("avx512f") == 0) return "AVX-512";
#endif
  return nullptr;
}

}  // namespace

}  // namespace scarp

int main(int argc, char** argv) {
  using namespace scarp;
  open_standard_streams();
  if (const char* const set = missing_instructions()) {
    return fail(could_not_go_on, std::string("this processor has no ") + set +
                                     ", which the program is compiled for: build it where it runs "
                                     "(at least SSE4.2 is needed)");
  }
  keep_freed_memory();
  try {
    return run_command_line(argc, argv);
  } catch (const InputError& error) {
    return fail(wrong_input, error.what());
  } catch (const NumericalError& error) {
    return fail(could_not_go_on, error.what());
  } catch (const std::filesystem::filesystem_error& error) {
    return fail(could_not_go_on, shown(error.path1()) + ": " + error.code().message());
  } catch (const std::bad_alloc&) {
    return fail(could_not_go_on, "out of memory; use a coarser spacing or a smaller extent");
  } catch (const std::system_error&) {
    return fail(could_not_go_on, no_threads);
  } catch (const std::exception& error) {
    if (is_lack_of_threads(error)) return fail(could_not_go_on, no_threads);
    return fail(could_not_go_on, mistake_text(error));
  }
}
