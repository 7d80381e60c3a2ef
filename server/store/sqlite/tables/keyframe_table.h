// Table keyframes: what was uploaded, unchanged.
#pragma once

#include <optional>

#include "core/base/status.h"
#include "server/store/sqlite/connection/connection.h"
#include "server/store/store_types.h"

namespace atlas {

// A row without its blob, checksum verified; the pose is not part of it.
struct KeyframeRow {
  KeyframeRecord record;  // the session key and the pose are left empty
  std::int64_t session_id = 0;
  std::uint64_t blob_hash = 0;
  std::uint32_t blob_bytes = 0;
};

Result<std::optional<KeyframeRow>> FindKeyframeRow(Connection& connection,
                                                   std::int64_t session_id,
                                                   std::uint32_t sequence);
// kInvalidData when there is none, or it is damaged.
Result<KeyframeRow> ReadKeyframeRow(Connection& connection, std::int64_t id);
// Row, session and pose. kNotFound, or kInvalidData when any of them is damaged.
Result<KeyframeRecord> ReadKeyframeRecord(Connection& connection, std::int64_t id);
// The same, and kInvalidData when a line of its poses' history is damaged.
Result<KeyframeRecord> VerifyKeyframeRecord(Connection& connection, std::int64_t id);
// With the pose and the session's state of that revision; nullopt: it was not there yet.
Result<std::optional<KeyframeRecord>> ReadKeyframeRecordAt(Connection& connection,
                                                           std::int64_t id,
                                                           std::uint64_t revision);
// nullopt: it was there and a compaction dropped it. kNotFound: it never was.
Result<std::optional<KeyframeRecord>> FindKeyframeRecord(Connection& connection,
                                                         const KeyframeKey& key);
// The blob, its hash verified.
Result<Bytes> ReadBlob(Connection& connection, std::int64_t id);

// By the index of keys alone: the row may be damaged. 0: there is none.
std::int64_t FindKeyframeId(Connection& connection,
                            std::int64_t session_id,
                            std::uint32_t sequence);
// By the same index: the ids of a session's keyframes in the order of their sequence numbers.
std::vector<std::int64_t> ListSessionKeyframes(Connection& connection, std::int64_t session_id);
// Those next to a sequence number, `count` at most, in the same order.
std::vector<std::int64_t> ListKeyframesBefore(Connection& connection,
                                              std::int64_t session_id,
                                              std::uint32_t sequence,
                                              std::size_t count);
std::vector<std::int64_t> ListKeyframesBehind(Connection& connection,
                                              std::int64_t session_id,
                                              std::int64_t sequence,
                                              std::size_t count);
// By the same index, with their sequence numbers: up to `count` behind one. kInvalidData: it does
// not have them in order.
struct IndexedKeyframe {
  std::int64_t id = 0;
  std::uint32_t sequence = 0;
};
Result<std::vector<IndexedKeyframe>> ListIndexedBehind(Connection& connection,
                                                       std::int64_t session_id,
                                                       std::int64_t sequence,
                                                       std::size_t count);
// kInvalidData when the row, its session, its pose, its tiles of now or its blob is damaged: fusion
// cannot have it.
Status CheckKeyframe(Connection& connection, std::int64_t id);
// The revision at which it was placed last, or its session entered or left the map.
std::uint64_t LastChange(Connection& connection, std::int64_t id);
// What is in the row, whatever its hash says; empty: no row.
Bytes ReadBlobUnchecked(Connection& connection, std::int64_t id);

void InsertKeyframe(Connection& connection,
                    const NewKeyframe& keyframe,
                    std::int64_t id,
                    std::int64_t session_id,
                    std::uint64_t revision);
// In the place of a damaged row: as it was inserted.
void RestoreKeyframe(Connection& connection,
                     const NewKeyframe& keyframe,
                     std::int64_t id,
                     std::int64_t session_id,
                     std::uint64_t revision);
// The row and its blob.
void DeleteKeyframe(Connection& connection, std::int64_t id);

}  // namespace atlas
