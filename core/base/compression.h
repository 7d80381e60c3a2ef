// zstd with its checksum on and the size declared: without the checksum most flipped bits pass.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "core/base/bytes.h"
#include "core/base/status.h"

namespace atlas {

// One zstd frame with content size and checksum. `level` 1..19.
Bytes Compress(ByteSpan bytes, int level);
// The same as a difference to `prefix`, which may be anything: what is alike takes next to nothing.
Bytes CompressAgainst(ByteSpan prefix, ByteSpan bytes, int level);

// The content of one frame whose declared size must equal `expected_size` (already capped by the
// caller). kInvalidData on another size, an unknown size, trailing bytes or damage.
Result<Bytes> Decompress(ByteSpan frame, std::size_t expected_size);
// The same into `content`, which has the expected size. After an error it holds anything.
Status DecompressInto(ByteSpan frame, std::span<std::uint8_t> content);
// The same of a difference. Another prefix is damage, unless nothing was like it.
Result<Bytes> DecompressAgainst(ByteSpan prefix, ByteSpan frame, std::size_t expected_size);

}  // namespace atlas
