// What may be asked of a session: the same words on both sides of the wire.
#pragma once

#include <cstdint>

namespace atlas {

// kRetract takes a session out of the map, kRestore makes a retracted one what it was before.
enum class SessionAction : std::uint8_t { kRetract, kRestore };

}  // namespace atlas
