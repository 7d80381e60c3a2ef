// A vehicle's or a tool's end of the protocol: one connection, one call at a time, one thread.
// Every failure is typed: the daemon's own errors keep their code, kUnavailable and kTimeout are
// the link's.
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "client/connection/atlas_watch.h"
#include "client/connection/daemon_connection.h"
#include "client/connection/endpoint.h"
#include "client/connection/name_lookup.h"
#include "client/connection/requests.h"
#include "core/base/status.h"
#include "core/geometry/map_profile.h"

namespace atlas {

class RpcChannel;

struct ConnectionOptions {
  Endpoint endpoint;
  std::string client_name = "libatlas_client";  // for the daemon's logs
  std::optional<MapProfile> expected_profile;   // another one: refused by the daemon
  std::optional<ConnectionTls> tls;             // none: in the clear
  // In the clear beyond loopback, too (127.0.0.0/8, ::1): whoever is on the way reads the token.
  // Else a host that has another address is kInvalidArgument before anything is connected to.
  bool allow_plaintext = false;
  std::string token;  // of a person; empty: none
  // A session whose upload goes on: the handshake says how far the daemon has it
  // (AtlasIdentity::last_sequence; docs/client.md says for whom that is enough).
  std::optional<SessionKey> resume;
  // From looking the host up to the end of the handshake, all of it.
  std::chrono::milliseconds connect_timeout{5'000};
  std::chrono::milliseconds request_timeout{30'000};  // until each frame of a reply is whole
  // The most that is believed of a daemon that wants to be left alone; it asks for 1 s or 5 s, or
  // for as long as a limit of its own lasts, up to an hour.
  std::chrono::milliseconds max_retry_after{60'000};
  std::shared_ptr<NameLookup>
      names;  // for the endpoint's host; null: a new one that asks the system
};

class AtlasClient {
 public:
  using TileCallback = std::function<Status(TileBlob)>;
  using KeyframeCallback = std::function<Status(SessionKeyframe)>;

  // Connects and shakes hands within `connect_timeout` (connect_attempt.h: over several calls).
  // kUnsupported when the daemon speaks another protocol version.
  static Result<AtlasClient> Connect(const ConnectionOptions& options);

  AtlasClient(const AtlasClient&) = delete;
  AtlasClient& operator=(const AtlasClient&) = delete;
  AtlasClient(AtlasClient&&) noexcept;
  AtlasClient& operator=(AtlasClient&&) noexcept;
  ~AtlasClient();

  const MapProfile& profile() const { return profile_; }
  const AtlasIdentity& atlas() const { return atlas_; }

  // Waits 3 ms longer for each pose than for other replies. After kTimeout and kUnavailable it may
  // have been applied.
  // All or nothing: kNotFound names an unknown keyframe, kInvalidData a refused pose. kConflict:
  // with a condition, what changed; or a session to be published that is neither staged nor in the
  // map. kUnsupported: with terms, a daemon before 1.11.
  Result<PoseBatchSummary> UpdatePoses(std::span<const PoseCorrection> corrections,
                                       const std::string& author,
                                       const BatchTerms& terms = {});
  // Another batch, by which the poses that one changed are what they were before it, and the
  // sessions that it published are staged again. kNotFound: there is none of that number, or what
  // was before it is no longer kept. kConflict names a keyframe that was corrected since, or a
  // session that is in another state since. kUnsupported: a daemon before 1.11.
  Result<PoseBatchSummary> UndoPoses(std::uint64_t batch, const std::string& author);
  // Calls back once a tile, in the order sent. A failing callback ends the query with its status.
  // kUnsupported: an earlier revision, and the daemon is too old for that.
  Result<RegionSummary> QueryRegion(const RegionQuery& query, const TileCallback& on_tile);
  // What is new in an area: calls back once a tile, in the order sent, as it arrives. Announced and
  // sent agree, or it ends with kInvalidData; what a blob says is the caller's to check. A failing
  // callback ends it with its status. A daemon that pauses for longer than the query's timeout and
  // `request_timeout` together is kTimeout. kUnsupported when the daemon is too old for syncs. A
  // callback that fails with kInvalidData says that the daemon sent what is no tile, which breaks
  // the connection.
  Result<SyncSummary> Sync(const SyncQuery& query, const TileCallback& on_tile);
  // Goes on with a reply that was left on its way, for `give_up` at most (0: to its end), as Sync
  // would have. Its summary is of the whole reply. kNotFound: another request was sent since, a
  // watch or an upload was listened to, or it is of another connection; what still comes of it is
  // thrown away.
  Result<SyncSummary> Continue(std::shared_ptr<SyncRest> rest,
                               std::chrono::milliseconds give_up,
                               const TileCallback& on_tile);
  // Tells what changes in an area (atlas_watch.h): watch first, then sync, and nothing is missed.
  // The request is on its way when it returns, or kUnavailable after `timeout` while an earlier one
  // is. kInvalidArgument for an area that is none. kUnsupported when the daemon is too old for it.
  Result<AtlasWatch> Watch(const WatchQuery& query, std::chrono::milliseconds timeout);
  Result<AtlasStatus> ReadStatus();
  // Returns when no tile is dirty; kTimeout after `timeout`.
  Result<WaitSummary> WaitUntilFused(std::chrono::milliseconds timeout);
  // All, or all of a vehicle, by vehicle and session. Page by page: one that begins or vanishes
  // meanwhile may be in it or not, every other one is. kUnsupported: with changes, a daemon before
  // 1.11.
  Result<std::vector<SessionSummary>> ListSessions(const std::string& vehicle = {},
                                                   SessionDetail detail = SessionDetail::kUsual);
  // Of a session, by rising sequence number: those that are stored. kNotFound: there is no such
  // session. kUnsupported: a daemon before 1.10.
  Result<std::vector<KeyframeSummary>> ListKeyframes(const SessionKey& session);
  // The same with their blobs, behind a sequence number (nullopt: from the first one on): calls
  // back once a keyframe, as they arrive, damaged ones too. A failing callback ends it with its
  // status. kUnsupported: a daemon before 1.11.
  Result<SessionReading> ReadKeyframes(const SessionKey& session,
                                       std::optional<std::uint32_t> after_sequence,
                                       const KeyframeCallback& on_keyframe);
  // Takes a session out of the map, or puts it back. kNotFound: unknown. One that is so already
  // stays as it is. The reason is for people: one line of at most 256 bytes, or none.
  Result<SessionChangeSummary> ChangeSession(const SessionKey& key,
                                             SessionAction action,
                                             const std::string& author,
                                             const std::string& reason = {});
  // All of a vehicle's sessions in one step. kNotFound: it has none, or none that is not purged.
  // kUnsupported: a daemon before 1.8.
  Result<SessionChangeSummary> ChangeVehicle(const std::string& vehicle,
                                             SessionAction action,
                                             const std::string& author,
                                             const std::string& reason = {});
  // Waits until no tile is dirty, `timeout` long. With a revision: of the atlas as it was then,
  // which is fused again meanwhile; kUnsupported when the daemon is too old for that.
  Result<DigestSummary> Digest(std::chrono::milliseconds timeout,
                               std::optional<std::uint64_t> at_revision = std::nullopt);
  // Drops keyframes taken before `before_ms` (since 1970) that matter nowhere any more. kTimeout:
  // nothing was dropped within `timeout`. kUnsupported when the daemon is too old for that.
  Result<CompactionSummary> Compact(std::int64_t before_ms,
                                    const std::string& author,
                                    std::chrono::milliseconds timeout);
  Result<VerifySummary> Verify(bool is_rebuild, std::chrono::milliseconds timeout);
  // The same, and what is damaged is restored where something tells how; damaged keyframes that
  // nothing tells of are deleted. kUnsupported: a daemon before 1.8.
  Result<VerifySummary> Repair(bool is_rebuild,
                               const std::string& author,
                               std::chrono::milliseconds timeout);
  // Has the daemon write a copy of its atlas into its folder for backups, and read it back; calls
  // back now and then. kConflict: there is a file of that name. kUnavailable: another one is being
  // written. kResourceExhausted: there is no room. kUnsupported: a daemon before 1.8. Whoever gives
  // up closes the connection, which ends it.
  Result<BackupSummary> Backup(const std::string& name,
                               const std::string& author,
                               std::chrono::milliseconds timeout,
                               const std::function<void(const BackupStage&)>& on_progress);
  // By name. kUnsupported as above.
  Result<std::vector<BackupFile>> ListBackups();
  // Above `after_id`, oldest first, up to a thousand; none: there are no more. kUnsupported as
  // above.
  Result<std::vector<AtlasEvent>> ListEvents(std::uint64_t after_id);

  // Nothing of use comes any more: the link failed, the daemon answered nothing in time, broke the
  // protocol or refused the connection. A request that it refused breaks nothing.
  bool is_broken() const;
  // How long the daemon still wants to be left alone, by what it refused for a while on this
  // connection (`retry_after_ms`); 0: it does not. Nothing here waits for it by itself.
  std::chrono::milliseconds retry_after() const;
  // The same without what it refused uploads for, which may be a limit of their vehicle alone.
  std::chrono::milliseconds retry_after_of_reads() const;
  std::uint64_t bytes_sent() const;
  std::uint64_t bytes_received() const;

 private:
  friend class ConnectAttempt;
  friend class KeyframeUploader;
  AtlasClient(std::unique_ptr<RpcChannel> channel, const MapProfile& profile, AtlasIdentity atlas);

  Status CheckPast(const std::optional<std::uint64_t>& at_revision) const;
  // kUnsupported naming `what`: the daemon is older than this minor version.
  Status CheckMinor(std::uint32_t needed, const char* what) const;
  Result<SyncSummary> Follow(std::shared_ptr<SyncRest> rest,
                             std::chrono::steady_clock::time_point latest,
                             const TileCallback& on_tile);

  std::shared_ptr<RpcChannel> channel_;  // a SyncRest knows it
  MapProfile profile_;
  AtlasIdentity atlas_;
};

}  // namespace atlas
