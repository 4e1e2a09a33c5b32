#include "apps/scarp/attended_run.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <csignal>
#include <iostream>
#include <limits>
#include <string_view>

#include "apps/estimate/expected_end.h"
#include "apps/run/restart.h"
#include "apps/run/tell.h"
#include "apps/scarp/command_line.h"
#include "core/plain_number.h"
#include "core/printable.h"
#include "core/system/atomic_file.h"

namespace scarp {

namespace {

using Clock = std::chrono::steady_clock;

std::atomic<bool> interrupt_requested{false};
std::atomic<bool> checkpoint_requested{false};

// Before the first file there is nothing to keep.
std::atomic<bool> is_under_way{false};

// The second one ends the process at once, and so does the first while a run is prepared.
void on_interrupt(int signal) {
  if (!is_under_way) _exit(interrupted);
  interrupt_requested = true;
  std::signal(signal, SIG_DFL);
  // The flux that is being solved may take a while.
  constexpr std::string_view text = "\nends with a checkpoint; a second signal ends it at once\n";
  [[maybe_unused]] const auto written = write(STDERR_FILENO, text.data(), text.size());
}

// The terminal is gone, or the time that a batch system gives is over, of which it tells more than
// once.
void on_last_call(int) { interrupt_requested = true; }

void on_checkpoint_request(int) { checkpoint_requested = true; }

void listen() {
  std::signal(SIGINT, on_interrupt);
  std::signal(SIGTERM, on_interrupt);
  std::signal(SIGXCPU, on_last_call);
  std::signal(SIGUSR1, on_checkpoint_request);
  // A limit on the size of files (ulimit -f) is then told as an error of the file that grew.
  std::signal(SIGXFSZ, SIG_IGN);
  // A run outlives who reads its messages.
  std::signal(SIGPIPE, SIG_IGN);
  // nohup lets it be ignored.
  if (std::signal(SIGHUP, on_last_call) == SIG_IGN) std::signal(SIGHUP, SIG_IGN);
}

// One line that is written over on a terminal; elsewhere a line at least every few seconds.
class Progress {
 public:
  Progress(std::span<const ProcessStep> steps, bool quiet)
      : steps_(steps), quiet_(quiet), terminal_(isatty(STDERR_FILENO) != 0) {
    left_.resize(steps.size() + 1);
    for (std::size_t n = steps.size(); n-- > 0;) left_[n] = left_[n + 1] + steps[n].duration;
  }

  ~Progress() {
    if (terminal_ && shown_) tell("\n");
  }

  void operator()(const State& state, const Survey& survey) {
    if (quiet_) return;
    const auto now = Clock::now();
    if (first_) {
      first_ = false;
      start_ = now;
      start_time_ = state.time;
    }
    const bool last = finished(state, steps_);
    if (!last && now - printed_ < (terminal_ ? std::chrono::milliseconds(100)
                                             : std::chrono::milliseconds(5000))) {
      return;
    }
    printed_ = now;
    shown_ = true;
    const double end = expected_end(state, survey, now);
    const std::string line = fmt::format(
        "{}  step \"{}\"  t = {} of {}{} s  {} facets of {}{}", terminal_ ? "\x1b[K" : "",
        current_step(state, steps_).name, plain_number(state.time, 4),
        is_guess(state) ? "about " : "", plain_number(end, 4), survey.facets.triangles.size(),
        survey.facets_full, time_left(state, end, now));
    tell(line + (terminal_ ? '\r' : '\n'));
  }

 private:
  // Of the recipe. Steps that ended early are over; of those to come none is known to.
  double expected_end(const State& state, const Survey& survey, Clock::time_point now) {
    if (state.step == steps_.size()) return state.time;
    // Looking for it takes longer than writing a line.
    if (step_ != state.step || now - looked_ > std::chrono::seconds(2)) {
      step_ = state.step;
      looked_ = now;
      // The speeds of the survey are those of the step before, where one has just begun.
      const ProcessStep& step = steps_[state.step];
      const bool is_of_step = state.time > state.step_start;
      duration_ = is_of_step ? expected_duration(step, state, survey) : step.duration;
      if (!is_of_step) looked_ = {};
    }
    return std::max(state.time, state.step_start + duration_) + left_[state.step + 1];
  }

  bool is_guess(const State& state) const {
    return std::any_of(steps_.begin() + static_cast<std::ptrdiff_t>(state.step), steps_.end(),
                       [](const ProcessStep& step) { return step.until || step.round_end; });
  }

  // From the pace since the first time step of this process.
  std::string time_left(const State& state, double end, Clock::time_point now) const {
    const double done = state.time - start_time_;
    if (done <= 0) return "";
    const double wall = std::chrono::duration<double>(now - start_).count();
    return "  " + plain_duration(wall * (end - state.time) / done) + " left";
  }

  std::span<const ProcessStep> steps_;
  bool quiet_;
  bool terminal_;
  std::vector<double> left_;  ///< of the durations of the steps, when each begins
  std::size_t step_ = std::numeric_limits<std::size_t>::max();  ///< that duration_ is of
  double duration_ = 0;                                         ///< as it is expected
  Clock::time_point looked_;
  bool first_ = true;
  bool shown_ = false;
  double start_time_ = 0;
  Clock::time_point start_;
  Clock::time_point printed_;
};

// A word that a shell takes as it is, in quotes where it would not: $'a\nb' is one line.
std::string for_shell(const std::string& word) {
  constexpr const char* plain =
      "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_./+,:=@%-";
  if (word.find_first_not_of(plain) == std::string::npos) return word;
  const bool has_lines = shown(word) != word;
  std::string quoted = has_lines ? "$'" : "'";
  for (const char c : word) {
    if (has_lines && (c == '\'' || c == '\\')) quoted += '\\';
    quoted += !has_lines && c == '\'' ? std::string("'\\''") : std::string(1, c);
  }
  return shown(quoted) + '\'';
}

}  // namespace

RunEnd attended_run(Recipe recipe, const std::filesystem::path& folder,
                    const AttendedOptions& options) {
  is_under_way = false;
  listen();
  try {
    const std::vector<ProcessStep> steps = recipe.steps;
    Progress progress(steps, options.quiet);
    return run(
        std::move(recipe), folder,
        {.resume = options.resume,
         .stop = &interrupt_requested,
         .checkpoint = &checkpoint_requested,
         .memory_limit_mb = options.memory_limit_mb,
         .log = Log(std::cerr, options.quiet ? Log::Level::warnings : Log::Level::everything),
         .begin = [] { is_under_way = true; },
         .progress = [&](const State& state, const Survey& survey) { progress(state, survey); }});
  } catch (const DiskFullError& error) {
    throw DiskFullError(fmt::format("{}, then {}", error.what(), how_to_go_on(folder)));
  }
}

std::string how_to_go_on(const std::filesystem::path& folder) {
  // The recipe in the folder has what --set changed; it is there before the first state is.
  const std::filesystem::path recipe = folder / "recipe.toml";
  if (!std::filesystem::exists(recipe) || states_of(folder).empty())
    return "run again: nothing was saved yet";
  return fmt::format("continue with: scarp run {} --resume -o {}", for_shell(recipe.string()),
                     for_shell(folder.string()));
}

}  // namespace scarp
