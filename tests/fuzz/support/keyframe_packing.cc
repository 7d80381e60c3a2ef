#include "tests/fuzz/support/keyframe_packing.h"

#include <algorithm>

#include "core/base/compression.h"
#include "core/base/hash.h"
#include "core/keyframe/keyframe_codec.h"
#include "tests/core/support/keyframe_worlds.h"

namespace atlas::fuzz {
namespace {

// docs/formats/keyframe.md: what is before the sizes, and these.
constexpr std::size_t kFieldBytes = 4 + 1 + 8 + 4 + 2 + 4 * 4 + 4;
constexpr std::size_t kSizesBytes = 8;
constexpr std::size_t kHashBytes = 8;
constexpr std::uint32_t kMaxBodyBytes = 8u << 20;

std::optional<Bytes> Unpack(ByteSpan blob) {
  if (blob.size() < kFieldBytes + kSizesBytes + kHashBytes) {
    return std::nullopt;
  }
  ByteReader sizes(blob.subspan(kFieldBytes));
  const std::uint32_t size = sizes.U32();
  const ByteSpan frame =
      blob.subspan(kFieldBytes + kSizesBytes, blob.size() - kFieldBytes - kSizesBytes - kHashBytes);
  const auto body =
      size <= kMaxBodyBytes ? Decompress(frame, size) : Error(StatusCode::kInvalidData, "");
  if (!body) {
    return std::nullopt;
  }
  ByteWriter flat;
  flat.Raw(blob.first(kFieldBytes));
  flat.Raw(*body);
  return flat.Take();
}

Bytes Pack(ByteSpan flat) {
  Bytes fields(flat.begin(),
               flat.begin() + static_cast<std::ptrdiff_t>(std::min(flat.size(), kFieldBytes)));
  fields.resize(kFieldBytes);
  const ByteSpan body = flat.subspan(std::min(flat.size(), kFieldBytes));
  const Bytes compressed = Compress(body, 1);
  ByteWriter out;
  out.Raw(fields);
  out.U32(static_cast<std::uint32_t>(body.size()));
  out.U32(static_cast<std::uint32_t>(compressed.size()));
  out.Raw(compressed);
  out.U64(Hash64(out.bytes()));
  return out.Take();
}

}  // namespace

Packing KeyframePacking() {
  return {&Unpack, &Pack, &SealAtEnd};
}

std::vector<Bytes> KeyframeSeeds(const MapProfile& profile) {
  return {EncodeKeyframe(testing::BlankKeyframe(profile, 1)),
          EncodeKeyframe(testing::RandomKeyframe(profile, 4, 1)),
          EncodeKeyframe(testing::RandomKeyframe(profile, 9, 2)),
          EncodeKeyframe(testing::StreetKeyframe(profile, 16, 3))};
}

}  // namespace atlas::fuzz
