#include "core/keyframe/keyframe_codec.h"

#include <algorithm>
#include <cassert>
#include <span>

#include "core/base/compression.h"
#include "core/base/hash.h"
#include "core/base/str_cat.h"
#include "core/keyframe/keyframe_body.h"
#include "core/keyframe/keyframe_body_check.h"

namespace atlas {
namespace {

constexpr std::uint32_t kMagic = 0x314B4152;  // "RAK1"
constexpr std::uint8_t kVersion = 1;
constexpr int kCompressionLevel = 3;  // measured: docs/formats/keyframe.md
constexpr std::size_t kChecksumBytes = 8;
constexpr std::size_t kKeptRoomBytes = std::size_t{1} << 20;  // of a thread that checks keyframes

struct BodySizes {
  std::uint32_t uncompressed = 0;
  std::uint32_t compressed = 0;
};

void WriteHeader(const Keyframe& keyframe, const BodySizes& sizes, ByteWriter& out) {
  out.U32(kMagic);
  out.U8(kVersion);
  out.U64(keyframe.profile_hash);
  out.U32(keyframe.grid.cell_size_um);
  out.U16(static_cast<std::uint16_t>(keyframe.grid.radius_cells));
  for (const std::int32_t part : keyframe.level_quaternion) {
    out.I32(part);
  }
  out.I32(keyframe.sensor_height_mm);
  out.U32(sizes.uncompressed);
  out.U32(sizes.compressed);
}

Status CheckMagicAndVersion(ByteReader& in) {
  if (in.U32() != kMagic) {
    return Status(StatusCode::kInvalidData, "keyframe: does not start with RAK1");
  }
  const std::uint8_t version = in.U8();
  if (!in.ok()) {
    return Status(StatusCode::kInvalidData, "keyframe: header is truncated");
  }
  if (version > kVersion) {
    return Status(StatusCode::kUnsupported, StrCat("keyframe: version ", int{version},
                                                   ", this build reads up to ", int{kVersion}));
  }
  return version == 0 ? Status(StatusCode::kInvalidData, "keyframe: version 0") : Status();
}

Status CheckSizes(const ByteReader& in, const GridGeometry& grid, const BodySizes& sizes) {
  if (in.remaining() != std::size_t{sizes.compressed} + kChecksumBytes) {
    return Status(StatusCode::kInvalidData,
                  StrCat("keyframe: ", in.remaining(), " bytes after the header, expected ",
                         std::size_t{sizes.compressed} + kChecksumBytes));
  }
  if (sizes.uncompressed > MaxKeyframeBodyBytes(grid)) {
    return Status(StatusCode::kInvalidData,
                  StrCat("keyframe: declares ", sizes.uncompressed, " bytes, at most ",
                         MaxKeyframeBodyBytes(grid), " fit its grid"));
  }
  return {};
}

// Reads and checks the header; `in` then stands at the body.
Status ParseHeader(ByteReader& in, KeyframeHeader& header, BodySizes& sizes) {
  if (in.remaining() > kMaxKeyframeBytes) {
    return Status(StatusCode::kInvalidData,
                  StrCat("keyframe: ", in.remaining(), " bytes, at most ", kMaxKeyframeBytes));
  }
  ATLAS_RETURN_IF_ERROR(CheckMagicAndVersion(in));
  header.profile_hash = in.U64();
  header.grid.cell_size_um = in.U32();
  header.grid.radius_cells = in.U16();
  for (std::int32_t& part : header.level_quaternion) {
    part = in.I32();
  }
  header.sensor_height_mm = in.I32();
  sizes.uncompressed = in.U32();
  sizes.compressed = in.U32();
  if (!in.ok()) {
    return Status(StatusCode::kInvalidData, "keyframe: header is truncated");
  }
  ATLAS_RETURN_IF_ERROR(
      ValidateKeyframeFrame(header.grid, header.level_quaternion, header.sensor_height_mm));
  return CheckSizes(in, header.grid, sizes);
}

Status CheckChecksum(ByteSpan blob) {
  const ByteSpan content = blob.first(blob.size() - kChecksumBytes);
  ByteReader stored(blob.last(kChecksumBytes));
  return stored.U64() == Hash64(content)
             ? Status()
             : Status(StatusCode::kInvalidData, "keyframe: checksum does not match");
}

// In `room`, which grows to it. Header and checksum are as they must be.
Result<ByteSpan> ReadBody(ByteSpan blob, KeyframeHeader& header, Bytes& room) {
  ByteReader in(blob);
  BodySizes sizes;
  if (Status status = ParseHeader(in, header, sizes); !status.ok()) {
    return Error(std::move(status));
  }
  if (Status status = CheckChecksum(blob); !status.ok()) {
    return Error(std::move(status));
  }
  room.resize(std::max<std::size_t>(room.size(), sizes.uncompressed));
  const auto body = std::span(room).first(sizes.uncompressed);
  if (Status status = DecompressInto(in.Raw(sizes.compressed), body); !status.ok()) {
    return Error(status.WithContext("keyframe"));
  }
  return body;
}

// Without cells.
Keyframe FrameOf(const KeyframeHeader& header) {
  Keyframe keyframe;
  keyframe.profile_hash = header.profile_hash;
  keyframe.grid = header.grid;
  keyframe.level_quaternion = header.level_quaternion;
  keyframe.sensor_height_mm = header.sensor_height_mm;
  return keyframe;
}

Result<KeyframeHeader> CheckKeyframeIn(ByteSpan blob, Bytes& room) {
  KeyframeHeader header;
  const Result<ByteSpan> body = ReadBody(blob, header, room);
  if (!body) {
    return Error(body.error());
  }
  Keyframe keyframe = FrameOf(header);
  if (!IsKeyframeBody(*body, header.grid, keyframe.block_count())) {
    if (Status status = DecodeKeyframeBody(*body, keyframe); !status.ok()) {  // names what is wrong
      return Error(std::move(status));
    }
  }
  return header;
}

}  // namespace

Bytes EncodeKeyframe(const Keyframe& keyframe) {
  assert(ValidateKeyframe(keyframe).ok());
  const Bytes body = EncodeKeyframeBody(keyframe);
  const Bytes compressed = Compress(body, kCompressionLevel);
  ByteWriter out;
  WriteHeader(
      keyframe,
      {static_cast<std::uint32_t>(body.size()), static_cast<std::uint32_t>(compressed.size())},
      out);
  out.Raw(compressed);
  out.U64(Hash64(out.bytes()));
  return out.Take();
}

Result<KeyframeHeader> ReadKeyframeHeader(ByteSpan blob) {
  ByteReader in(blob);
  KeyframeHeader header;
  BodySizes sizes;
  if (Status status = ParseHeader(in, header, sizes); !status.ok()) {
    return Error(std::move(status));
  }
  return header;
}

Result<Keyframe> DecodeKeyframe(ByteSpan blob) {
  KeyframeHeader header;
  Bytes room;
  const Result<ByteSpan> body = ReadBody(blob, header, room);
  if (!body) {
    return Error(body.error());
  }
  Keyframe keyframe = FrameOf(header);
  if (Status status = DecodeKeyframeBody(*body, keyframe); !status.ok()) {
    return Error(std::move(status));
  }
  return keyframe;
}

Result<KeyframeHeader> CheckKeyframe(ByteSpan blob) {
  thread_local Bytes room;  // new pages for each are a tenth of the check
  auto header = CheckKeyframeIn(blob, room);
  if (room.size() > kKeptRoomBytes) {
    room = Bytes();
  }
  return header;
}

Status CheckKeyframeProfile(const KeyframeHeader& header, const MapProfile& profile) {
  if (header.profile_hash != profile.Hash()) {
    return Status(StatusCode::kInvalidData,
                  StrCat("keyframe: made for profile ", std::hex, header.profile_hash,
                         ", this atlas has ", profile.Hash()));
  }
  if (header.grid.cell_size_um != profile.cell_size_um) {
    return Status(StatusCode::kInvalidData,
                  StrCat("keyframe: cell size is ", header.grid.cell_size_m(),
                         " m, this atlas has ", profile.cell_size_m()));
  }
  return {};
}

}  // namespace atlas
