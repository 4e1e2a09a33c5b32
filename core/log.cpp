#include "core/log.h"

#include <spdlog/logger.h>
#include <spdlog/sinks/ostream_sink.h>

#include <string>

#include "core/printable.h"

namespace scarp {

struct Log::Sink {
  spdlog::logger logger;
};

Log::Log() = default;

Log::Log(std::ostream& out, Level level)
    : sink_(std::make_shared<Sink>(Sink{spdlog::logger(
          "scarp", std::make_shared<spdlog::sinks::ostream_sink_mt>(out, /*force_flush=*/true))})) {
  sink_->logger.set_pattern("%v");
  sink_->logger.set_level(level == Level::warnings ? spdlog::level::warn : spdlog::level::info);
}

void Log::info(std::string_view line) const {
  if (sink_) sink_->logger.info(printable(line));
}

void Log::warn(std::string_view line) const {
  if (sink_) sink_->logger.warn(printable(std::string("warning: ").append(line)));
}

}  // namespace scarp
