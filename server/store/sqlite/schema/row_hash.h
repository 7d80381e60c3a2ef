// The checksum that every row carries: Hash64 over the table's number and the row's values.
#pragma once

#include <cstdint>
#include <string_view>

#include "core/base/bytes.h"
#include "core/base/hash.h"
#include "server/store/sqlite/connection/connection.h"

namespace atlas {

// Frozen numbers (docs/formats/store.md): equal values in two tables do not have equal checksums.
enum class RowKind : std::uint8_t {
  kMeta = 1,
  kSession = 2,
  kFormerKeyframe = 3,
  kPose = 4,
  kPoseHistory = 5,
  kPoseBatch = 6,
  kTile = 7,
  kSessionState = 8,
  kCompaction = 9,
  kTombstone = 10,
  kStart = 11,
  kCounter = 12,
  kFootprint = 13,
  kDirtyTile = 14,
  kEvent = 15,
  kDamagedKeyframe = 16,
  kKeyframe = 17,
};

// Integers as 8 bytes little-endian, text and bytes with their length before them.
class RowHash {
 public:
  explicit RowHash(RowKind kind) { out_.U8(static_cast<std::uint8_t>(kind)); }

  RowHash& Int(std::int64_t value) {
    out_.I64(value);
    return *this;
  }
  RowHash& Unsigned(std::uint64_t value) {
    out_.U64(value);
    return *this;
  }
  RowHash& Text(std::string_view text) {
    out_.String(text);
    return *this;
  }
  RowHash& Raw(ByteSpan bytes) {
    out_.Varint(bytes.size());
    out_.Raw(bytes);
    return *this;
  }
  std::int64_t value() const { return static_cast<std::int64_t>(Hash64(out_.bytes())); }

 private:
  ByteWriter out_;
};

// Statements of the connection may call row_hash(kind, value...) then: the hash of integers.
void AddRowHash(Connection& connection);

}  // namespace atlas
