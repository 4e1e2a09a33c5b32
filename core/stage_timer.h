#pragma once

#include <chrono>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace scarp {

/// Wall seconds by named stage. Nothing in a run may depend on them.
class StageTimer {
 public:
  /// Adds the time of its life to a stage.
  class Measurement {
   public:
    Measurement(StageTimer& timer, std::string_view stage)
        : timer_(timer), stage_(stage), start_(std::chrono::steady_clock::now()) {}
    ~Measurement() {
      const std::chrono::duration<double> time = std::chrono::steady_clock::now() - start_;
      timer_.add(stage_, time.count());
    }
    Measurement(const Measurement&) = delete;
    Measurement& operator=(const Measurement&) = delete;

   private:
    StageTimer& timer_;
    std::string stage_;
    std::chrono::steady_clock::time_point start_;
  };

  [[nodiscard]] Measurement measure(std::string_view stage) { return {*this, stage}; }

  void add(std::string_view stage, double seconds) {
    for (auto& [name, total] : stages_) {
      if (name == stage) {
        total += seconds;
        return;
      }
    }
    stages_.emplace_back(stage, seconds);
  }

  void add(const StageTimer& other) {
    for (const auto& [name, seconds] : other.stages_) add(name, seconds);
  }

  /// 0 for a stage that never ran.
  double seconds(std::string_view stage) const {
    for (const auto& [name, total] : stages_) {
      if (name == stage) return total;
    }
    return 0;
  }

  /// In the order in which they were first met.
  const std::vector<std::pair<std::string, double>>& stages() const { return stages_; }

 private:
  std::vector<std::pair<std::string, double>> stages_;
};

}  // namespace scarp
