#include "server/store/sqlite/transactions/keyframe_contents.h"

#include <exception>
#include <utility>
#include <vector>

#include "core/base/str_cat.h"
#include "server/store/sqlite/connection/sqlite_error.h"
#include "server/store/sqlite/tables/keyframe_row.h"
#include "server/store/sqlite/tables/keyframe_table.h"
#include "server/store/sqlite/tables/pose_table.h"
#include "server/store/sqlite/tables/session_table.h"

namespace atlas {
namespace {

constexpr std::size_t kAtOnce = 64;  // of the index

Result<KeyframeContent> ReadContent(Connection& connection, const FullKeyframeRow& row) {
  const std::int64_t id = row.row.record.id;
  const auto pose = ReadPose(connection, id);
  if (!pose) {
    return Error(pose.error());
  }
  auto blob = ReadBlob(connection, id);
  if (!blob) {
    return Error(blob.error());
  }
  return KeyframeContent{
      row.row.record.key.sequence, row.row.record.time_ms, *pose, row.prior, *std::move(blob), {}};
}

// What `read` throws where a page cannot be read is damage of what it reads, too.
template <typename T, typename Read>
Result<T> Caught(const Read& read) {
  try {
    return read();
  } catch (const std::exception& error) {
    return Error(StatusFromException(error));
  }
}

// One after the other, as long as there is room.
class Reading {
 public:
  Reading(Connection& connection, std::int64_t session_id, std::size_t max_bytes)
      : connection_(connection), session_id_(session_id), left_bytes_(max_bytes) {}

  // False: there was no room for it.
  Result<bool> Add(const IndexedKeyframe& entry) {
    const auto row = Caught<FullKeyframeRow>([&]() -> Result<FullKeyframeRow> {
      auto read = ReadFullKeyframeRow(connection_, entry.id);
      const bool is_it = read && read->row.session_id == session_id_ &&
                         read->row.record.key.sequence == entry.sequence;
      return is_it || !read
                 ? std::move(read)
                 : Error(StatusCode::kInvalidData,
                         StrCat("store: the index of keyframe ", entry.id, " is damaged"));
    });
    if (!row && row.error().code() != StatusCode::kInvalidData) {
      return Error(row.error());
    }
    const std::size_t bytes = kKeyframeBesidesBlobBytes + (row ? row->row.blob_bytes : 0);
    if (bytes > left_bytes_) {
      contents_.next_bytes = bytes;
      return false;
    }
    left_bytes_ -= bytes;
    auto content = row ? Caught<KeyframeContent>([&] { return ReadContent(connection_, *row); })
                       : Result<KeyframeContent>(Error(row.error()));
    if (!content && content.error().code() != StatusCode::kInvalidData) {
      return Error(content.error());
    }
    contents_.keyframes.push_back(
        content ? *std::move(content)
                : KeyframeContent{.sequence = entry.sequence, .damage = content.error()});
    return true;
  }
  KeyframeContents Take() { return std::move(contents_); }

 private:
  Connection& connection_;
  const std::int64_t session_id_;
  std::size_t left_bytes_;
  KeyframeContents contents_;
};

}  // namespace

Result<KeyframeContents> ReadKeyframeContents(Connection& connection,
                                              const SessionKey& session,
                                              std::optional<std::uint32_t> after_sequence,
                                              std::size_t max_bytes) {
  const auto row = FindSession(connection, session);
  if (!row) {
    return Error(row.error());
  }
  if (!*row) {
    return Error(StatusCode::kNotFound, StrCat("session ", session, " is not in the atlas"));
  }
  Reading reading(connection, (*row)->id, max_bytes);
  std::int64_t behind = after_sequence ? std::int64_t{*after_sequence} : -1;
  while (true) {
    const auto entries = ListIndexedBehind(connection, (*row)->id, behind, kAtOnce);
    if (!entries) {
      return Error(entries.error());
    }
    for (const IndexedKeyframe& entry : *entries) {
      const auto is_added = reading.Add(entry);
      if (!is_added) {
        return Error(is_added.error());
      }
      if (!*is_added) {
        return reading.Take();
      }
      behind = entry.sequence;
    }
    if (entries->size() < kAtOnce) {
      return reading.Take();
    }
  }
}

}  // namespace atlas
