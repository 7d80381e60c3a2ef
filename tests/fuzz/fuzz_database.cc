// An atlas file with bytes changed anywhere, as it is read alone and as a daemon opens, verifies
// and serves it. The input is a list of changes: where (4 bytes), how many (1 byte), which.
#include <algorithm>
#include <filesystem>
#include <optional>

#include "core/tile/tile_codec.h"
#include "server/store/sqlite/sqlite_store.h"
#include "server/store/sqlite/store_snapshot.h"
#include "tests/fuzz/support/fuzz_target.h"
#include "tests/fuzz/support/scratch_folder.h"
#include "tests/fuzz/support/tiny_atlas.h"

namespace atlas::fuzz {
namespace {

constexpr std::size_t kMaxChanges = 64;

Bytes Change(std::uint32_t at, ByteSpan bytes) {
  ByteWriter out;
  out.U32(at);
  out.U8(static_cast<std::uint8_t>(bytes.size()));
  out.Raw(bytes);
  return out.Take();
}

// Nothing, and a word in the file's header that nobody reads.
std::vector<Bytes> Seeds() {
  return {Change(0, {}), Change(72, Bytes{1, 2, 3, 4})};
}

Bytes Changed(ByteSpan changes) {
  static const Bytes kWhole = TinyAtlas().Close();
  Bytes file = kWhole;
  ByteReader in(changes);
  for (std::size_t i = 0; i < kMaxChanges && in.remaining() > 0; ++i) {
    const std::size_t at = in.U32() % file.size();
    const ByteSpan bytes = in.Raw(in.U8());
    std::copy_n(bytes.begin(), std::min(bytes.size(), file.size() - at),
                file.begin() + static_cast<std::ptrdiff_t>(at));
  }
  return file;
}

// As programs do that read an atlas file without a daemon.
bool ReadAlone(const std::filesystem::path& file) {
  auto atlas = StoreSnapshot::Open(file);
  if (!atlas) {
    return false;
  }
  bool is_whole = true;
  const MapProfile& profile = atlas->identity().profile;
  for (std::uint8_t level = 0; level < profile.levels; ++level) {
    const Status status = atlas->ScanTiles({level}, [&](const TileSummary& summary) {
      const auto tile = atlas->ReadTile(summary.id);
      if (!tile || !*tile) {
        return tile ? Status() : tile.error();
      }
      const auto decoded = DecodeTile((*tile)->blob, profile);
      return decoded ? Status() : decoded.error();
    });
    is_whole = is_whole && status.ok();
  }
  return is_whole;
}

bool ReadAsDaemon(const ScratchFolder& folder) {
  SqliteStoreOptions options;
  options.directory = folder.path();
  options.writer_cache_kib = 1'024;
  auto store = OpenSqliteStore(options);
  if (!store) {
    return false;
  }
  ServiceOptions service_options;
  service_options.fusion.workers = 0;
  service_options.scratch_directory = folder.path();
  AtlasService service(
      **store, [] { return TinyAtlas::kNow_ms; }, [](LogLevel, const std::string&) {},
      service_options);
  const auto report = service.Verify({}, {std::chrono::seconds(5), {}});
  static_cast<void>(service.ListSessions({}, 1'000));
  static_cast<void>(service.ReadStatus());
  const Patience patience{std::chrono::seconds(5), {}};
  static_cast<void>(service.DigestAt(1, patience));
  auto query = service.Query({}, {.tile_cost = [](const StoredTile& tile) {
                               return tile.blob.size();
                             }});
  while (query) {
    const auto tile = service.NextTile(*query);
    if (!tile || !*tile) {
      break;
    }
  }
  return report && report->damaged == 0;
}

bool Run(ByteSpan changes) {
  const ScratchFolder folder;
  const auto file = folder.Write("atlas.db", Changed(changes));
  const bool is_read = ReadAlone(file);
  return ReadAsDaemon(folder) && is_read;
}

}  // namespace

const Target kTarget{&Seeds, &Run, &MutatePlain};

}  // namespace atlas::fuzz
