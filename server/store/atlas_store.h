// The store of one atlas: keyframes, poses with their history, dirty marks, and the tiles made of
// them. Every write is one transaction; `done` is called once it is on disk, on the store's own
// thread, and must not block. Reads may be called from any thread, see one snapshot each, and hold
// nothing when they return. Rows whose checksum is wrong are kInvalidData and name the row.
//
// Writes fail with kResourceExhausted on a full disk, kUnavailable when the queue is full, the disk
// fails or became read-only, or the store is closing; they then left no trace.
#pragma once

#include <filesystem>
#include <functional>
#include <set>
#include <span>
#include <vector>

#include "core/base/status.h"
#include "server/store/backup_types.h"
#include "server/store/compaction_types.h"
#include "server/store/damage_types.h"
#include "server/store/event_types.h"
#include "server/store/keyframe_content.h"
#include "server/store/store_types.h"
#include "server/store/tile_index.h"
#include "server/store/upload_limits.h"
#include "server/store/write_figures.h"

namespace atlas {

class AtlasStore : public TileIndex {
 public:
  template <typename T>
  using Done = std::function<void(Result<T>)>;

  virtual const StoreIdentity& identity() const = 0;
  // Of the last change on disk; whoever was told of a change finds it counted. Never blocks, and is
  // of no snapshot: a reader may see what is just being committed.
  virtual std::uint64_t revision() const = 0;
  // An opening is noted with the first change that it makes, by the same transaction. Of starts
  // before a damaged one nothing is known.
  virtual Result<AtlasLine> ReadLine() = 0;

  // Same key, blob hash and time as a stored one: a duplicate, nothing changes, even if its pose
  // was corrected since, unless what is stored is damaged: that is put right then. Other content
  // under the key: kConflict. Marks the footprint dirty. All the same where a compaction dropped
  // the stored one. kUnavailable: it would begin a session, and its vehicle began too many.
  // kResourceExhausted with one of kUploadRefusalReasons: it would be stored, and the limits
  // leave no room; nothing else that is written here minds them.
  virtual void PutKeyframe(NewKeyframe keyframe, Done<PutKeyframeResult> done) = 0;
  // All or nothing; kNotFound names the first unknown key. A pose equal to the stored one changes
  // and marks nothing. Marks the union of the old and the new footprints. Neither uploads nor poses
  // of a session that is not in the map mark anything. Of a keyframe that a compaction dropped
  // nothing changes. With a condition: errors as CheckUnchanged. Sessions that it publishes come
  // into the map by the same step, judged as when they are published by themselves; kConflict: one
  // is neither staged nor in the map already. kInvalidData: something is named twice.
  virtual void UpdatePoses(PoseBatch batch, Done<PoseBatchResult> done) = 0;
  // Another batch, by which all that one changed becomes what it was before it: its poses, and the
  // sessions that it published are staged again (or published, if it had staged them again).
  // Keyframes that came to these since stay in them. `undo` is made of what ReadBatchToUndo tells,
  // errors as there.
  virtual void UndoPoses(PoseUndo undo, Done<PoseBatchResult> done) = 0;

  // One transaction: the state, its line in the history, a mark on every tile that a keyframe of
  // the session touches. A session that is so already: nothing changes. kNotFound: unknown. The
  // same for all sessions of a vehicle; the state is then that of the last one.
  virtual void ChangeSession(SessionChange change, Done<SessionChangeResult> done) = 0;

  // One transaction: the keyframes go with their poses and footprints, tombstones stay, and no
  // revision before this one can be read any more. Marks nothing: whoever asks knows that the tiles
  // stay as they are. Without any keyframe nothing is written. kConflict: a tile that one of them
  // touches changed since the revision that this was found out at. kInvalidData: one is not there,
  // or damaged.
  virtual void Compact(Compaction compaction, Done<CompactionResult> done) = 0;

  // Leases up to `max_tiles` dirty tiles of the lowest level in the wave: a level starts when the
  // one below is done, so that each parent is built once.
  virtual void ClaimDirty(ClaimRequest request, Done<ClaimResult> done) = 0;
  // Stores, replaces or deletes a tile. Its revision moves, and its parent is marked, only when its
  // payload hash does. The mark is cleared only if its generation is still the claimed one.
  // kConflict when the claim's lease ran out and was given to another owner, or was built.
  virtual void FinishTile(FinishedTile tile, Done<FinishResult> done) = 0;
  // Gives a claim back, to be taken again at `retry_at_ms`, or at once if the tile was marked
  // again.
  virtual void ReleaseClaim(TileClaim claim, std::int64_t retry_at_ms, Done<bool> done) = 0;
  // Marks tiles to be built again, e.g. one that was found damaged. The value: marks set.
  virtual void MarkDirty(std::vector<TileId> ids, Done<std::uint32_t> done) = 0;
  // By which rules tiles are fused from now on. Where they were fused by others, every tile is
  // marked, in the same transaction: it is what its keyframes say by these. The value: marks set.
  virtual void AdoptFusionRules(std::uint64_t rules, Done<std::uint64_t> done) = 0;

  // Looks whether these keyframes can be fused. Those that are damaged and that the atlas itself
  // cannot restore are listed, once, and stay out of the map until PutKeyframe brings the same
  // bytes or RepairKeyframe ends it. The value: listed anew.
  virtual void NoteDamage(std::vector<std::int64_t> keyframes, Done<std::uint32_t> done) = 0;
  virtual void RepairKeyframe(KeyframeRepair repair, Done<RepairOutcome> done) = 0;
  // The value: how much was not as it should be.
  virtual void RepairTables(TableRepair what, std::string author, Done<std::uint32_t> done) = 0;

  // A copy of one state in `file`, read back (backup_writing.h); takes minutes, while all else goes
  // on. kConflict, kNotFound, kResourceExhausted: `file`, its folder, its disk. kInvalidData: what
  // is damaged. What ends the work: its status. After an error there is none.
  virtual Result<AtlasFacts> WriteBackup(const std::filesystem::path& file,
                                         const BackupWork& work) = 0;
  // An event about one.
  virtual void NoteBackup(BackupNote note, Done<bool> done) = 0;

  enum class ProbeDepth { kQueue, kDisk };
  // Goes the way of a write and changes nothing: `done` tells that the queue moves and, with kDisk,
  // that the disk takes what is written.
  virtual void Probe(ProbeDepth depth, Done<bool> done) = 0;
  // Since the store was opened; never blocks for long.
  virtual WriteFigures ReadWriteFigures() const = 0;
  // Of uploads from now on.
  virtual void SetUploadLimits(const UploadLimits& limits) = 0;
  // What they say now; never waits for the store.
  virtual RoomFigures ReadRoom() = 0;
  // Returns when every write queued before it is done and has been reported.
  virtual void Flush() = 0;

  // Whether these sessions are what they were at a revision: no keyframe came to one, no pose of
  // theirs was corrected, none is in another state, nothing of them was dropped or deleted.
  // kConflict names the first one that is not, what changed and when; or `revision` is so old, or
  // lost, that nothing tells. kInvalidArgument: the atlas is not there yet. kNotFound: there is no
  // such session.
  virtual Status CheckUnchanged(const std::set<SessionKey>& sessions, std::uint64_t revision) = 0;
  // What a batch changed, and the poses before it. kNotFound: there is no such batch, or what was
  // before it is no longer kept. kConflict names the first keyframe that was corrected since, or
  // the session that it put into a state that it is not in any more.
  virtual Result<BatchToUndo> ReadBatchToUndo(std::uint64_t batch) = 0;
  // In the order of `keys`; kNotFound names the first unknown one.
  virtual Result<FoundKeyframes> FindKeyframes(std::span<const KeyframeKey> keys) = 0;
  // Those of a session behind `after_sequence`, which nobody need have; nullopt: from the first one
  // on. `limit` is at least 1. kNotFound: there is no such session.
  virtual Result<KeyframePage> ListKeyframes(const SessionKey& session,
                                             std::optional<std::uint32_t> after_sequence,
                                             std::uint32_t limit) = 0;
  // Keyframes of a session behind `after_sequence` with their blobs, as many as count for
  // `max_bytes` together: a blob's size and kKeyframeBesidesBlobBytes each. Damaged ones say so.
  // kNotFound: there is no such session.
  virtual Result<KeyframeContents> ReadKeyframes(const SessionKey& session,
                                                 std::optional<std::uint32_t> after_sequence,
                                                 std::size_t max_bytes) = 0;
  // The keyframes of live sessions whose footprints touch a level-0 tile: those that were not there
  // at revision `since`, or not as they are now. All of them, and `is_whole`, where `since` is 0 or
  // before the last compaction: nothing tells any more what it dropped.
  virtual Result<TileSources> GatherTile(const TileId& id, std::uint64_t since) = 0;
  // The same as of an earlier revision: the keyframes that were there, in sessions that were live,
  // each with the pose it had. Some may not touch the tile. Errors as CheckRevision.
  virtual Result<TileSources> GatherTileAt(const TileId& id, std::uint64_t revision) = 0;
  // kInvalidArgument: the atlas is not there yet. kNotFound: so old that its history is gone, or
  // lost to a restore.
  virtual Status CheckRevision(std::uint64_t revision) = 0;
  virtual Result<Bytes> ReadKeyframeBlob(std::int64_t id) = 0;
  // Row, session and pose, without a look at its tiles.
  virtual Result<KeyframeRecord> ReadKeyframeRecord(std::int64_t id) = 0;
  // Those that touch or touched a level-0 tile, whether they are damaged or not.
  virtual Result<std::vector<std::int64_t>> ListKeyframesOfTile(const TileId& id) = 0;
  virtual Result<std::vector<DamagedKeyframe>> ListDamagedKeyframes() = 0;
  // Ids above `after_id` in order, up to `limit`: those, too, of which only a pose or a list of
  // tiles is left.
  virtual Result<std::vector<std::int64_t>> ListKeyframeIds(std::int64_t after_id,
                                                            std::uint32_t limit) = 0;
  // One keyframe with its pose, session and footprint, of one snapshot: every checksum around it is
  // verified, those of its earlier poses too. The footprint has none: it must be of the revision of
  // the last change.
  virtual Result<StoredKeyframe> ReadKeyframe(std::int64_t id) = 0;

  // nullopt: there is no such tile. kInvalidData, too: it is listed, and its row is not found.
  virtual Result<std::optional<StoredTile>> ReadTile(const TileId& id) = 0;
  // Tiles above `after_key` in key order, all levels, up to `limit`; `after_key` -1 is the start.
  virtual Result<std::vector<TileSummary>> ListTiles(std::int64_t after_key,
                                                     std::uint32_t limit) = 0;
  // Tiles of `level` in whose area some keyframe touches a level-0 tile, or did at an earlier pose:
  // above `after_key` in key order, up to `limit`; -1 is the start. Others are and were empty.
  virtual Result<std::vector<TileId>> ListFootprintTiles(std::uint8_t level,
                                                         std::int64_t after_key,
                                                         std::uint32_t limit) = 0;
  // Calls `visit` for every such tile in the rectangle, in key order.
  virtual Status ScanFootprintTiles(const TileRect& rect,
                                    const std::function<void(const TileId&)>& visit) = 0;

  virtual Result<DirtyState> ReadDirtyState() = 0;
  virtual Result<StoreCounts> ReadCounts() = 0;
  // Behind `after` by vehicle and session, whether there is one of that name or not, up to `limit`:
  // damaged ones, too, which say so.
  virtual Result<std::vector<SessionRecord>> ListSessions(const SessionKey& after,
                                                          std::uint32_t limit) = 0;
  // The same with the revisions at which they changed last (CheckUnchanged), which takes a look at
  // each of their keyframes: a page is shorter where these are many.
  virtual Result<SessionPage> ListChangedSessions(const SessionKey& after, std::uint32_t limit) = 0;
  // nullopt: unknown.
  virtual Result<std::optional<SessionRecord>> FindSession(const SessionKey& key) = 0;
  // Verifies every checksum of a session's history and of what is left of its dropped keyframes.
  virtual Status CheckSession(const SessionKey& key) = 0;
  // Verifies every compaction's checksum, and that it left as many tombstones as it dropped
  // keyframes.
  virtual Status CheckCompactions() = 0;
  // Counts all rows, adds up their checksums and compares, in one snapshot. kInvalidData where rows
  // vanished.
  virtual Status CheckCounters() = 0;
  // Whether every row is found by its number and by every index, and by them nothing else: what is
  // not gives wrong answers without an error. Reads all rows and no blobs, of each index in a
  // snapshot of its own. kInvalidData names each that is damaged; a failed `check_stop` ends it.
  virtual Status CheckIndexes(const std::function<Status()>& check_stop) = 0;
  // What happened beside uploads: above `after_id` in order, up to `limit`; damaged ones, too,
  // which say so.
  virtual Result<std::vector<Event>> ListEvents(std::uint64_t after_id, std::uint32_t limit) = 0;
};

}  // namespace atlas
