// Makes the log before any thread: two threads that log for the first time at the same moment look
// like a race to ThreadSanitizer, since libspdlog and its guards are built without it. The daemon
// makes its log first, too.
#include <spdlog/spdlog.h>

namespace atlas {
namespace {

[[maybe_unused]] const auto early_log = spdlog::default_logger();

}  // namespace
}  // namespace atlas
