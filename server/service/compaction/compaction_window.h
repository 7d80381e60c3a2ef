// Which stretch of time a step of automatic compaction looks at.
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "server/store/session_types.h"

namespace atlas {

// The end (ms since 1970, not in it) of the window from `from_ms` on in which about so many
// keyframes lie, were those of each session spread over its time: one window is a part of the
// atlas, and its rows go in one transaction. Never shorter than 1 ms. nullopt: none lie behind.
std::optional<std::int64_t> EndOfWindow(std::span<const SessionRecord> sessions,
                                        std::int64_t from_ms,
                                        std::uint64_t keyframes);

}  // namespace atlas
