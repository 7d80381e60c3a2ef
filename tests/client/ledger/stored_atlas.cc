#include "tests/client/ledger/stored_atlas.h"

#include <stdexcept>
#include <utility>

#include "core/base/hash.h"
#include "server/store/sqlite/sqlite_store.h"

namespace atlas::testing {
namespace {

constexpr std::uint32_t kPage = 1'000;

void Expect(const Status& status) {
  if (!status.ok()) throw std::runtime_error(status.message());
}

template <typename T>
T ValueOf(Result<T> result) {
  if (!result) Expect(result.error());
  return *std::move(result);
}

}  // namespace

StoredAtlas ReadStoredAtlas(const std::filesystem::path& data) {
  SqliteStoreOptions options;
  options.directory = data;
  const auto store = ValueOf(OpenSqliteStore(options));
  StoredAtlas atlas;
  std::int64_t last = 0;
  for (auto ids = ValueOf(store->ListKeyframeIds(last, kPage)); !ids.empty();
       ids = ValueOf(store->ListKeyframeIds(last, kPage))) {
    for (const std::int64_t id : ids) {
      const KeyframeRecord record = ValueOf(store->ReadKeyframe(id)).record;
      const Bytes blob = ValueOf(store->ReadKeyframeBlob(id));
      const bool is_new =
          atlas.frames.insert({record.key, {record.time_ms, record.pose, Hash64(blob)}}).second;
      atlas.twice += is_new ? 0U : 1U;
    }
    last = ids.back();
  }
  for (const SessionRecord& session : ValueOf(store->ListSessions({}, 1'000'000))) {
    Expect(store->CheckSession(session.key));
    atlas.states[session.key] = session.state;
  }
  Expect(store->CheckCounters());
  return atlas;
}

}  // namespace atlas::testing
