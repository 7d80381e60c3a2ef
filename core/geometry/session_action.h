// What may be asked of a session: the same words on both sides of the wire.
#pragma once

#include <cstdint>

namespace atlas {

// kRetract takes a session out of the map, kRestore puts a retracted one back. kRelease keeps one
// in the map whatever its keyframes look like. kPurge deletes it for good. kPublish puts a staged
// one into the map.
enum class SessionAction : std::uint8_t { kRetract, kRestore, kRelease, kPurge, kPublish };

}  // namespace atlas
