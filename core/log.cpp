#include "core/log.h"

#include <mutex>
#include <string>

#include "core/printable.h"

namespace scarp {

struct Log::Sink {
  std::ostream& out;
  Level level;
  std::mutex mutex{};

  // At once, so that a run that is killed has said what it did.
  void write(const std::string& line) {
    const std::lock_guard lock(mutex);
    out << line << '\n' << std::flush;
  }
};

Log::Log() = default;

Log::Log(std::ostream& out, Level level) : sink_(new Sink{.out = out, .level = level}) {}

void Log::info(std::string_view line) const {
  if (sink_ && sink_->level == Level::everything) sink_->write(printable(line));
}

void Log::warn(std::string_view line) const {
  if (sink_) sink_->write(printable(std::string("warning: ").append(line)));
}

}  // namespace scarp
