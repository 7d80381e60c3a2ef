// Independent pieces of work on a few threads.
#pragma once

#include <cstddef>
#include <functional>

#include "core/base/status.h"

namespace atlas {

// Calls run(worker, i) once for each i below `count`, each worker from a thread of its own, the
// first from the caller's, in order as they get free. An error ends it: those under way are
// finished, and the error returned is of the least i that failed. `run` keeps results by i: they do
// not depend on `workers`, at least 1.
Status RunParallel(std::size_t count,
                   std::size_t workers,
                   const std::function<Status(std::size_t worker, std::size_t i)>& run);

}  // namespace atlas
