#pragma once

#include <cstddef>
#include <functional>
#include <utility>
#include <vector>

namespace scarp {

/// Calls body(begin, end) on disjoint ranges that cover 0..count, on all threads of the current
/// limit.
///
/// Ranges are multiples of grain (the last may be shorter) and do not depend on the number of
/// threads, so a body that sums per range gives the same bits on any machine. A body must not
/// throw: write a status and throw after the join.
void parallel_for(std::size_t count, std::size_t grain,
                  const std::function<void(std::size_t begin, std::size_t end)>& body);

/// Joins what body(begin, end) gives for each of the same ranges, in their order.
template <class T, class Body, class Join>
T parallel_reduce(std::size_t count, std::size_t grain, T start, const Body& body,
                  const Join& join) {
  std::vector<T> parts((count + grain - 1) / grain, start);
  parallel_for(count, grain, [&](std::size_t begin, std::size_t end) {
    parts[begin / grain] = body(begin, end);
  });
  for (const T& part : parts) start = join(std::move(start), part);
  return start;
}

/// Calls both, at the same time where there is a second thread. As bodies of parallel_for they must
/// not throw, and may use it themselves.
void in_parallel(const std::function<void()>& first, const std::function<void()>& second);

/// Calls work, whose parallel loops use at most so many threads; 0 for all. Other threads of the
/// process are free to do the same at the same time.
void with_threads(int count, const std::function<void()>& work);

/// Limits the number of threads of the process while it lives; 0 means all cores.
class ThreadLimit {
 public:
  explicit ThreadLimit(int threads);
  ~ThreadLimit();
  ThreadLimit(const ThreadLimit&) = delete;
  ThreadLimit& operator=(const ThreadLimit&) = delete;

 private:
  void* control_;
};

/// The number of threads that parallel_for uses now.
int thread_count();

}  // namespace scarp
