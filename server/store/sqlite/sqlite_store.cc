#include "server/store/sqlite/sqlite_store.h"

#include <exception>
#include <functional>
#include <utility>

#include "core/base/str_cat.h"
#include "server/store/sqlite/atlas_opening.h"
#include "server/store/sqlite/backup/backup_writing.h"
#include "server/store/sqlite/connection/log_copier.h"
#include "server/store/sqlite/connection/reader_pool.h"
#include "server/store/sqlite/connection/sqlite_error.h"
#include "server/store/sqlite/connection/sync_guard.h"
#include "server/store/sqlite/connection/write_queue.h"
#include "server/store/sqlite/data_directory.h"
#include "server/store/sqlite/database_room.h"
#include "server/store/sqlite/revision_note.h"
#include "server/store/sqlite/schema/counters.h"
#include "server/store/sqlite/schema/index_check.h"
#include "server/store/sqlite/schema/schema.h"
#include "server/store/sqlite/schema/stored_bytes.h"
#include "server/store/sqlite/tables/compaction_table.h"
#include "server/store/sqlite/tables/damaged_keyframe_table.h"
#include "server/store/sqlite/tables/dirty_table.h"
#include "server/store/sqlite/tables/event_table.h"
#include "server/store/sqlite/tables/footprint_table.h"
#include "server/store/sqlite/tables/keyframe_table.h"
#include "server/store/sqlite/tables/session_table.h"
#include "server/store/sqlite/tables/start_table.h"
#include "server/store/sqlite/tables/tile_table.h"
#include "server/store/sqlite/transactions/compaction_transactions.h"
#include "server/store/sqlite/transactions/counter_check.h"
#include "server/store/sqlite/transactions/current_reads.h"
#include "server/store/sqlite/transactions/damage_transactions.h"
#include "server/store/sqlite/transactions/history_reads.h"
#include "server/store/sqlite/transactions/keyframe_contents.h"
#include "server/store/sqlite/transactions/pose_transactions.h"
#include "server/store/sqlite/transactions/session_changes.h"
#include "server/store/sqlite/transactions/session_transactions.h"
#include "server/store/sqlite/transactions/transactions.h"
#include "server/store/sqlite/transactions/upload_turn.h"
#include "server/store/tile_directory.h"
#include "server/store/upload_room.h"

namespace atlas {
namespace {

DatabaseOptions ReaderOptions(const SqliteStoreOptions& options, std::filesystem::path file) {
  return {std::move(file), DatabaseOptions::Mode::kReadOnly, options.reader_cache_kib, 5'000};
}

// Whoever is in the way is asked again later: a writer waits meanwhile.
DatabaseOptions CopierOptions(std::filesystem::path file) {
  return {std::move(file), DatabaseOptions::Mode::kReadWrite, 64, 100};
}

constexpr std::size_t kFewPoses = 64;  // of a batch, that shares a transaction with other writes

std::uint64_t ReadRevision(Connection& connection) {
  return ReadCounter(connection, Counter::kRevision);
}

class SqliteStore final : public AtlasStore {
 public:
  SqliteStore(const SqliteStoreOptions& options, DataDirectory directory, OpenedAtlas atlas)
      : directory_(std::move(directory)),
        identity_(std::move(atlas.identity)),
        tiles_(options.tile_directory_bytes),
        room_(FreeBytesBeside(directory_.database_file())),
        note_(directory_.database_file(), identity_, atlas.log, atlas.revision_alone),
        guard_(options.on_failed_sync),
        log_(CopierOptions(directory_.database_file()), {}, *atlas.writer, guard_),
        writes_(std::move(atlas.writer),
                {options.max_queued_writes, options.max_group, &ReadRevision,
                 [this](Connection& connection) { room_.NoteUsed(ReadUsedBytes(connection)); },
                 std::bind_front(&RevisionNote::Write, &note_)},
                guard_),
        readers_(ReaderOptions(options, directory_.database_file()), options.max_readers) {
    if (atlas.may_have_purged) {
      log_.EmptySoon();
    }
  }

  const StoreIdentity& identity() const override { return identity_; }
  std::uint64_t revision() const override { return writes_.revision(); }
  Result<AtlasLine> ReadLine() override {
    return readers_.Run<AtlasLine>([](Connection& connection) {
      return AtlasLine{ReadStarts(connection), ReadCounter(connection, Counter::kRevision)};
    });
  }

  void PutKeyframe(NewKeyframe keyframe, Done<PutKeyframeResult> done) override {
    done = Noting(keyframe, std::move(done));
    Write<PutKeyframeResult>(
        std::move(done), [this, k = std::move(keyframe)](Connection& connection) {
          return k.missing == nullptr ? PutKeyframeInStore(connection, k, room_)
                                      : PutInTurn(connection, k, room_);
        });
  }
  void UpdatePoses(PoseBatch batch, Done<PoseBatchResult> done) override {
    // In a savepoint many poses would take time by their square (decision 0701).
    const bool is_alone = batch.poses.size() > kFewPoses || !batch.published.empty();
    Write<PoseBatchResult>(std::move(done),
                           [this, b = std::move(batch)](Connection& connection) {
                             return UpdatePosesInStore(connection, identity_, b);
                           },
                           {.is_alone = is_alone});
  }
  void UndoPoses(PoseUndo undo, Done<PoseBatchResult> done) override {
    Write<PoseBatchResult>(
        std::move(done),
        [u = std::move(undo)](Connection& connection) { return UndoPosesInStore(connection, u); },
        {.is_alone = true});
  }
  void ChangeSession(SessionChange change, Done<SessionChangeResult> done) override {
    const bool is_purge = change.action == SessionAction::kPurge;
    const std::function<void()> empty_soon = [this] {
      log_.EmptySoon();
    };
    Write<SessionChangeResult>(std::move(done),
                               [c = std::move(change)](Connection& connection) {
                                 return ChangeSessionInStore(connection, c);
                               },
                               {.is_alone = is_purge, .settle = is_purge ? empty_soon : nullptr});
  }
  void Compact(Compaction compaction, Done<CompactionResult> done) override {
    Write<CompactionResult>(std::move(done), [c = std::move(compaction)](Connection& connection) {
      return CompactInStore(connection, c);
    });
  }
  void ClaimDirty(ClaimRequest request, Done<ClaimResult> done) override {
    const std::uint8_t levels = identity_.profile.levels;
    Write<ClaimResult>(std::move(done), [levels, r = std::move(request)](Connection& connection) {
      return ClaimDirtyInStore(connection, r, levels);
    });
  }
  void FinishTile(FinishedTile tile, Done<FinishResult> done) override {
    const std::uint8_t levels = identity_.profile.levels;
    const TileId id = tile.claim.id;
    Write<FinishResult>(std::move(done),
                        [levels, t = std::move(tile)](Connection& connection) {
                          return FinishTileInStore(connection, t, levels);
                        },
                        {.settle = [this, id] {
                          tiles_.Forget(id);
                        }});
  }
  void ReleaseClaim(TileClaim claim, std::int64_t retry_at_ms, Done<bool> done) override {
    Write<bool>(std::move(done), [retry_at_ms, c = std::move(claim)](Connection& connection) {
      const bool is_held = CheckClaim(connection, c).ok();
      if (is_held) {
        PostponeClaim(connection, c, retry_at_ms);
      }
      return Result<bool>(is_held);
    });
  }
  void MarkDirty(std::vector<TileId> ids, Done<std::uint32_t> done) override {
    Write<std::uint32_t>(std::move(done), [i = std::move(ids)](Connection& connection) {
      return Result<std::uint32_t>(MarkDirtyInStore(connection, i));
    });
  }
  void AdoptFusionRules(std::uint64_t rules, Done<std::uint64_t> done) override {
    Write<std::uint64_t>(
        std::move(done), [rules, levels = identity_.profile.levels](Connection& connection) {
          return Result<std::uint64_t>(AdoptFusionRulesInStore(connection, rules, levels));
        });
  }

  void NoteDamage(std::vector<std::int64_t> keyframes, Done<std::uint32_t> done) override {
    Write<std::uint32_t>(std::move(done), [k = std::move(keyframes)](Connection& connection) {
      return Result<std::uint32_t>(NoteDamageInStore(connection, k));
    });
  }
  void RepairKeyframe(KeyframeRepair repair, Done<RepairOutcome> done) override {
    Write<RepairOutcome>(std::move(done), [r = std::move(repair)](Connection& connection) {
      return RepairKeyframeInStore(connection, r);
    });
  }
  void RepairTables(TableRepair what, std::string author, Done<std::uint32_t> done) override {
    const std::uint8_t levels = identity_.profile.levels;
    const std::function<void()> empty_soon = [this] {
      log_.EmptySoon();  // one of two sessions that become one may be purged
    };
    Write<std::uint32_t>(
        std::move(done),
        [what, levels, a = std::move(author)](Connection& connection) {
          return RepairTablesInStore(connection, what, levels, a);
        },
        {.is_alone = true, .settle = what == TableRepair::kRows ? empty_soon : nullptr});
  }

  Result<AtlasFacts> WriteBackup(const std::filesystem::path& file,
                                 const BackupWork& work) override {
    return WriteAtlasBackup(directory_.database_file(), file, work);
  }
  void NoteBackup(BackupNote note, Done<bool> done) override {
    Write<bool>(std::move(done), [n = std::move(note)](Connection& connection) {
      AddEvent(connection, {EventKind::kBackup, n.author, n.name, n.detail});
      return Result<bool>(true);
    });
  }

  void Probe(ProbeDepth depth, Done<bool> done) override {
    writes_.SubmitProbe(MakeWrite<bool>(std::move(done), [depth](Connection& connection) {
      if (depth == ProbeDepth::kDisk) {
        AddToCounter(connection, Counter::kRevision, 0);  // a change, as who counts commits has it
        WriteUnchanged(connection);
      }
      return Result<bool>(true);
    }));
  }
  WriteFigures ReadWriteFigures() const override {
    WriteFigures figures = writes_.ReadFigures();
    for (const auto& other : {log_.last_failure(), room_.last_refusal()}) {
      if (other && (!figures.last_refusal || figures.last_refusal->when < other->when)) {
        figures.last_refusal = other;
      }
    }
    return figures;
  }
  void SetUploadLimits(const UploadLimits& limits) override { room_.set_limits(limits); }
  RoomFigures ReadRoom() override { return room_.ReadFigures(UploadRoom::Clock::now()); }
  void Flush() override { writes_.Flush(); }

  Status CheckUnchanged(const std::set<SessionKey>& sessions, std::uint64_t revision) override {
    return readers_.Check(&atlas::CheckUnchanged, identity_, sessions, revision);
  }
  Result<BatchToUndo> ReadBatchToUndo(std::uint64_t batch) override {
    return readers_.Read(&atlas::ReadBatchToUndo, batch);
  }
  Result<FoundKeyframes> FindKeyframes(std::span<const KeyframeKey> keys) override {
    return readers_.Read(&FindKeyframeRecords, keys);
  }
  Result<KeyframePage> ListKeyframes(const SessionKey& session,
                                     std::optional<std::uint32_t> after_sequence,
                                     std::uint32_t limit) override {
    return readers_.Read(&ReadKeyframePage, session, after_sequence, limit);
  }
  Result<KeyframeContents> ReadKeyframes(const SessionKey& session,
                                         std::optional<std::uint32_t> after_sequence,
                                         std::size_t max_bytes) override {
    return readers_.Read(&ReadKeyframeContents, session, after_sequence, max_bytes);
  }
  Result<TileSources> GatherTile(const TileId& id, std::uint64_t since) override {
    return readers_.Read(&GatherTileSources, id, since);
  }
  Result<TileSources> GatherTileAt(const TileId& id, std::uint64_t revision) override {
    return readers_.Read(&GatherTileSourcesAt, id, revision);
  }
  Status CheckRevision(std::uint64_t revision) override {
    ATLAS_RETURN_IF_ERROR(identity_.CheckNotLost(revision));
    return readers_.Check(&CheckRevisionKept, revision);
  }
  Result<Bytes> ReadKeyframeBlob(std::int64_t id) override { return readers_.Read(&ReadBlob, id); }
  Result<KeyframeRecord> ReadKeyframeRecord(std::int64_t id) override {
    return readers_.Read(&atlas::ReadKeyframeRecord, id);
  }
  Result<std::vector<std::int64_t>> ListKeyframesOfTile(const TileId& id) override {
    return readers_.Read(&atlas::ListKeyframesOfTile, id);
  }
  Result<std::vector<DamagedKeyframe>> ListDamagedKeyframes() override {
    return readers_.Read(&ReadDamagedKeyframes);
  }
  Result<std::vector<std::int64_t>> ListKeyframeIds(std::int64_t after_id,
                                                    std::uint32_t limit) override {
    return readers_.Read(&ListKeyframeRows, after_id, limit);
  }
  Result<StoredKeyframe> ReadKeyframe(std::int64_t id) override {
    return readers_.Read(&VerifyStoredKeyframe, id);
  }

  Result<std::optional<StoredTile>> ReadTile(const TileId& id) override {
    return readers_.Read(&ReadTileRow, id);
  }
  Result<TileBlock> ReadTileBlock(std::uint64_t block) override;
  TileBlock FindTileBlock(std::uint64_t block) override { return tiles_.Find(block); }
  Status ScanTiles(const TileRect& rect,
                   const std::function<void(const TileSummary&)>& visit) override;
  Result<std::vector<TileSummary>> ListTiles(std::int64_t after_key, std::uint32_t limit) override {
    return readers_.Read(&ListTileRows, after_key, limit);
  }
  Result<std::vector<TileId>> ListFootprintTiles(std::uint8_t level,
                                                 std::int64_t after_key,
                                                 std::uint32_t limit) override {
    return readers_.Read(&ListFootprintRows, level, after_key, limit);
  }
  Status ScanFootprintTiles(const TileRect& rect,
                            const std::function<void(const TileId&)>& visit) override {
    return readers_.Check(&ScanFootprintRows, rect, visit);
  }

  Result<DirtyState> ReadDirtyState() override { return readers_.Read(&ReadDirty); }
  Result<StoreCounts> ReadCounts() override {
    return readers_.Run<StoreCounts>([this](Connection& connection) {
      StoreCounts counts = ReadStoreCounts(connection);
      counts.store_bytes = directory_.StoreBytes();
      return Result<StoreCounts>(counts);
    });
  }
  Result<std::vector<SessionRecord>> ListSessions(const SessionKey& after,
                                                  std::uint32_t limit) override {
    return readers_.Read(&ReadSessions, after, limit);
  }
  Result<SessionPage> ListChangedSessions(const SessionKey& after, std::uint32_t limit) override {
    return readers_.Read(&ReadChangedSessions, after, limit);
  }
  Result<std::optional<SessionRecord>> FindSession(const SessionKey& key) override {
    return readers_.Read(&FindSessionRecord, key);
  }
  Status CheckSession(const SessionKey& key) override {
    return readers_.Check(&CheckSessionHistory, key);
  }
  Status CheckCompactions() override { return readers_.Check(&CheckCompactionRows); }
  Result<std::vector<Event>> ListEvents(std::uint64_t after_id, std::uint32_t limit) override {
    return readers_.Read(&ReadEvents, after_id, limit);
  }
  Status CheckCounters() override { return readers_.Check(&atlas::CheckCounters); }

  Status CheckIndexes(const std::function<Status()>& check_stop) override {
    return CheckStructure(
        [this](const StructureCheck& check) { return readers_.ReadStatus(check); }, check_stop);
  }

 private:
  // As WriteQueue::Operation has them.
  struct Manner {
    bool is_alone = false;
    std::function<void()> settle = nullptr;
  };
  // Queues `work`, which returns a Result<T>; `done` gets it once it is on disk.
  template <typename T, typename Work>
  void Write(Done<T> done, Work work, Manner manner) {
    WriteQueue::Operation operation = MakeWrite<T>(std::move(done), std::move(work));
    operation.is_alone = manner.is_alone;
    operation.settle = std::move(manner.settle);
    writes_.Submit(std::move(operation));
  }
  template <typename T, typename Work>
  void Write(Done<T> done, Work work) {
    writes_.Submit(MakeWrite<T>(std::move(done), std::move(work)));
  }

  DataDirectory directory_;  // first in, last out: the lock outlives every connection
  StoreIdentity identity_;
  TileDirectory tiles_;  // outlives the writes, which report to it
  UploadRoom room_;      // as do these three, all that writes
  RevisionNote note_;
  SyncGuard guard_;
  LogCopier log_;  // outlives the writer: whoever is closed last empties the write-ahead log
  WriteQueue writes_;
  ReaderPool readers_;
};

Result<TileBlock> SqliteStore::ReadTileBlock(std::uint64_t block) {
  if (TileBlock kept = tiles_.Find(block)) {
    return kept;
  }
  const std::uint64_t version = tiles_.Version(block);
  Result<TileBlock> read = readers_.Run<TileBlock>([block](Connection& connection) {
    return Result<TileBlock>(
        std::make_shared<const std::vector<TileSummary>>(ReadTileBlockRows(connection, block)));
  });
  if (read) {
    tiles_.Insert(block, version, *read);
  }
  return read;
}

Status SqliteStore::ScanTiles(const TileRect& rect,
                              const std::function<void(const TileSummary&)>& visit) {
  return readers_.ReadStatus([&](Connection& connection) {
    ScanTileRows(connection, rect, visit);
    return Status();
  });
}

}  // namespace

Result<std::unique_ptr<AtlasStore>> OpenSqliteStore(const SqliteStoreOptions& options) {
  auto directory = DataDirectory::Lock(options.directory);
  if (!directory) {
    return Error(directory.error());
  }
  directory->FreeRoom();
  auto atlas = OpenAtlas(*directory, options);
  if (!atlas) {
    return Error(atlas.error());
  }
  const std::filesystem::path file = directory->database_file();
  try {
    return std::make_unique<SqliteStore>(options, std::move(*directory), *std::move(atlas));
  } catch (const std::exception& error) {
    return Error(StatusFromException(error).WithContext(file.string()));
  }
}

}  // namespace atlas
