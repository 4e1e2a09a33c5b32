// Loaded before all other libraries (LD_PRELOAD): a request for a checkpoint comes while they are
// initialised, before main().

#include <csignal>

namespace {

[[gnu::constructor]] void ask_for_a_checkpoint() { std::raise(SIGUSR1); }

}  // namespace
