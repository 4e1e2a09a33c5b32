#include "apps/scarp/tetrahedra.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <cstring>
#include <map>
#include <optional>

#include "core/error.h"
#include "core/printable.h"
#include "core/system/read_file.h"
#include "core/system/temporary_folder.h"

namespace scarp {

namespace {

namespace fs = std::filesystem;

// Of the program that fills the mesh; 0 while there is none.
volatile std::sig_atomic_t running = 0;
volatile std::sig_atomic_t interrupted_by = 0;

void end_the_program(int signal) {
  interrupted_by = signal;
  if (running != 0) kill(running, SIGTERM);
}

/// While it exists an interrupt ends the program that runs, and this one afterwards: by then its
/// temporary files are gone.
class Interrupts {
 public:
  Interrupts() {
    for (std::size_t k = 0; k < signals.size(); ++k) {
      before_[k] = std::signal(signals[k], end_the_program);
      if (before_[k] == SIG_IGN) std::signal(signals[k], SIG_IGN);
    }
  }
  ~Interrupts() {
    for (std::size_t k = 0; k < signals.size(); ++k) std::signal(signals[k], before_[k]);
    if (interrupted_by != 0) std::raise(interrupted_by);
  }
  Interrupts(const Interrupts&) = delete;
  Interrupts& operator=(const Interrupts&) = delete;

 private:
  static constexpr std::array<int, 3> signals{SIGINT, SIGTERM, SIGHUP};
  std::array<void (*)(int), 3> before_{};
};

/// The exit code of a program that was found in PATH; nothing where there is none. What it prints
/// goes to a file.
std::optional<int> run_program(const std::vector<std::string>& words, const fs::path& printed) {
  std::vector<std::string> copies = words;
  std::vector<char*> arguments;
  arguments.reserve(words.size() + 1);
  for (std::string& word : copies) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, printed.c_str(),
                                   O_WRONLY | O_CREAT | O_TRUNC, 0600);
  posix_spawn_file_actions_adddup2(&actions, STDOUT_FILENO, STDERR_FILENO);
  pid_t child = 0;
  const int error =
      posix_spawnp(&child, arguments.front(), &actions, nullptr, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (error == ENOENT) return std::nullopt;
  if (error != 0)
    throw NumericalError(fmt::format("{}: cannot be run: {}", words.front(), std::strerror(error)));
  running = child;
  if (interrupted_by != 0) kill(child, SIGTERM);
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  running = 0;
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

[[noreturn]] void fail(const std::string& program, int exit_code, const fs::path& printed) {
  const std::string text = read_file(printed);
  constexpr std::size_t shown_length = 600;
  throw NumericalError(
      fmt::format("{} ended with exit code {}: {}", program, exit_code,
                  printable(text.substr(text.size() - std::min(text.size(), shown_length)))));
}

/// The first body of each region.
std::map<int, int> first_bodies(const RegionMesh& mesh) {
  std::map<int, int> first;
  for (std::size_t body = 0; body < mesh.bodies.size(); ++body)
    first.try_emplace(mesh.bodies[body].region, static_cast<int>(body));
  return first;
}

std::optional<ReadTets> filled_by_tetgen(const RegionMesh& mesh, const fs::path& folder) {
  write_smesh(folder / "wafer.smesh", mesh);
  const fs::path printed = folder / "tetgen.txt";
  // A: regions; Y: facets stay; q: well-shaped tetrahedra.
  const auto exit_code =
      run_program({"tetgen", "-pAYq", (folder / "wafer.smesh").string()}, printed);
  if (!exit_code) return std::nullopt;
  if (*exit_code != 0 || !fs::exists(folder / "wafer.1.ele")) fail("tetgen", *exit_code, printed);
  ReadTets read = read_tetgen_tets(folder / "wafer.1");
  const std::map<int, int> bodies = first_bodies(mesh);
  for (BodyTet& tet : read.tets) {
    const auto body = bodies.find(tet.body);  // tetgen knows regions only
    if (body == bodies.end()) throw NumericalError("tetgen: a tetrahedron is in no region");
    tet.body = body->second;
  }
  return read;
}

std::optional<ReadTets> filled_by_gmsh(const RegionMesh& mesh, const fs::path& folder) {
  write_msh(folder / "wafer.msh", named_mesh(mesh));
  const fs::path printed = folder / "gmsh.txt";
  const fs::path filled = folder / "filled.msh";
  // Nodes keep their numbers.
  const auto exit_code =
      run_program({"gmsh", "-3", "-setnumber", "Mesh.Renumber", "0", "-format", "msh41", "-o",
                   filled.string(), (folder / "wafer.msh").string()},
                  printed);
  if (!exit_code) return std::nullopt;
  if (*exit_code != 0 || !fs::exists(filled)) fail("gmsh", *exit_code, printed);
  return read_gmsh_tets(filled);
}

}  // namespace

NamedMesh filled_by_program(const RegionMesh& mesh) {
  const Interrupts interrupts;
  const TemporaryFolder folder;
  std::optional<ReadTets> read = filled_by_tetgen(mesh, folder);
  if (!read) read = filled_by_gmsh(mesh, folder);
  if (!read) {
    throw InputError(
        "--tetrahedra: neither tetgen nor gmsh is installed; install one, for example by \"apt-get "
        "install tetgen\", or leave out --tetrahedra to write the surfaces");
  }
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    if (v >= read->vertices.size() ||
        length(read->vertices[v] - mesh.vertices[v]) > 1e-6 * length(mesh.vertices[v]))
      throw NumericalError("--tetrahedra: the program has moved vertices of the surfaces");
  }
  return filled_mesh(mesh, std::move(read->vertices), read->tets);
}

}  // namespace scarp
