#pragma once

#include <memory>
#include <ostream>
#include <string_view>

namespace scarp {

/// Where a run tells what it does: a value that is handed in, line by line, safe from any thread.
class Log {
 public:
  enum class Level { everything, warnings };

  /// Says nothing.
  Log();
  /// Writes to a stream that has to outlive the log and its copies.
  explicit Log(std::ostream& out, Level level = Level::everything);

  void info(std::string_view line) const;
  /// The line stands behind "warning: ".
  void warn(std::string_view line) const;

 private:
  struct Sink;
  std::shared_ptr<Sink> sink_;
};

}  // namespace scarp
