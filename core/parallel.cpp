#include "core/parallel.h"

#include <tbb/global_control.h>
#include <tbb/info.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>

namespace scarp {

void parallel_for(std::size_t count, std::size_t grain,
                  const std::function<void(std::size_t begin, std::size_t end)>& body) {
  if (count > 0 && count <= grain) return body(0, count);
  const std::size_t ranges = (count + grain - 1) / grain;
  tbb::parallel_for(std::size_t{0}, ranges, [&](std::size_t range) {
    body(range * grain, std::min(count, (range + 1) * grain));
  });
}

void in_parallel(const std::function<void()>& first, const std::function<void()>& second) {
  parallel_for(2, 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) i == 0 ? first() : second();
  });
}

void with_threads(int count, const std::function<void()>& work) {
  if (count <= 0) return work();
  // More than there are would be a warning on standard error.
  tbb::task_arena(std::min(count, tbb::info::default_concurrency())).execute(work);
}

ThreadLimit::ThreadLimit(int threads)
    : control_(threads > 0 ? new tbb::global_control(tbb::global_control::max_allowed_parallelism,
                                                     static_cast<std::size_t>(threads))
                           : nullptr) {}

ThreadLimit::~ThreadLimit() { delete static_cast<tbb::global_control*>(control_); }

int thread_count() {
  const auto of_process = static_cast<int>(
      tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism));
  // Only what with_threads() calls is in an arena that is not as large as the machine.
  const int here = tbb::this_task_arena::max_concurrency();
  return here == tbb::info::default_concurrency() ? of_process : std::min(here, of_process);
}

}  // namespace scarp
