// A tile blob or a difference between two, without a look into its sections: header and table.
// Internal to core/tile.
#pragma once

#include <cstdint>
#include <vector>

#include "core/base/bytes.h"
#include "core/base/status.h"

namespace atlas {

inline constexpr std::uint32_t kTileMagic = 0x31544152;       // "RAT1"
inline constexpr std::uint32_t kTileDeltaMagic = 0x31444152;  // "RAD1"
inline constexpr int kTileCompressionLevel = 3;               // measured: docs/formats/tile.md

struct RawSection {
  std::uint16_t id = 0;
  std::uint32_t uncompressed_bytes = 0;
  std::uint64_t hash = 0;  // of the compressed bytes; in a difference of the content
  ByteSpan compressed;     // a view
};

struct RawContainer {
  std::uint64_t key = 0;
  std::uint64_t profile_hash = 0;
  std::uint8_t preset = 0;
  std::vector<RawSection> sections;  // ids rising
};

// Verifies the header. kUnsupported on another version, kInvalidData otherwise. The blob outlives
// what is read.
Result<RawContainer> ReadRaw(ByteSpan blob, std::uint32_t magic);

Bytes WriteRaw(const RawContainer& container, std::uint32_t magic);

}  // namespace atlas
