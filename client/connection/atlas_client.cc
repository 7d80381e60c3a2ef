#include "client/connection/atlas_client.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "client/connection/connect_attempt.h"
#include "client/connection/rpc_channel.h"
#include "client/connection/sync_exchange.h"
#include "core/base/str_cat.h"
#include "proto/wire/convert.h"

namespace atlas {
namespace {

using Body = wire::Envelope;
using Clock = RpcChannel::Clock;
using std::chrono::milliseconds;

constexpr std::uint32_t kMinorWithPast = 2;
constexpr std::uint32_t kMinorWithSync = 4;
constexpr std::uint32_t kMinorWithWatch = 5;
constexpr std::uint32_t kMinorWithChanges = 11;

// Of a call that is given up after this; 0: never.
Clock::time_point EndAfter(milliseconds give_up) {
  return give_up.count() > 0 ? Clock::now() + give_up : Clock::time_point::max();
}

wire::Envelope RegionRequest(const RegionQuery& query) {
  wire::Envelope request;
  wire::QueryRegion& region = *request.mutable_query_region();
  if (query.disc) {
    wire::QueryRegion::Disc& disc = *region.mutable_disc();
    disc.set_x_um(std::llround(query.disc->center_m.x() * 1e6));
    disc.set_y_um(std::llround(query.disc->center_m.y() * 1e6));
    disc.set_radius_um(static_cast<std::uint64_t>(std::llround(query.disc->radius_m * 1e6)));
  }
  region.set_finest_level(query.finest_level);
  region.set_only_finest(query.is_only_finest);
  region.set_budget_bytes(query.budget_bytes);
  if (query.at_revision) {
    region.set_at_revision(*query.at_revision);
    region.set_timeout_ms(TimeoutField(query.at_timeout));
  }
  return request;
}

// A place or a radius that does not fit a message is refused before it is rounded.
Status CheckDisc(const RegionQuery& query) {
  if (!query.disc) return {};
  const bool is_place = query.disc->center_m.cwiseAbs().maxCoeff() <= 1e7;
  const bool is_radius = query.disc->radius_m >= 0.0 && query.disc->radius_m <= 1e8;
  return is_place && is_radius
             ? Status()
             : Status(StatusCode::kInvalidArgument,
                      "region: expected a centre within +-10000 km and a radius of 0 to 100000 km");
}

Result<TileBlob> TileFromWire(wire::TileMessage& message) {
  const Result<TileId> id = TileId::FromKey(message.key());
  if (!id) return Error(id.error());
  const ByteSpan blob = BytesFromWire(message.blob());
  return TileBlob{*id, message.revision(), message.payload_hash(), Bytes(blob.begin(), blob.end())};
}

RegionSummary SummaryFromWire(const wire::QueryEnd& end) {
  return {end.tiles(), end.bytes(), end.revision(), end.truncated()};
}

AtlasStatus StatusFromWire(const wire::StatusReply& reply) {
  AtlasStatus status;
  status.revision = reply.revision();
  status.keyframes = reply.keyframes();
  status.sessions = reply.sessions();
  status.tiles = reply.tiles();
  status.dirty_tiles = reply.dirty_tiles();
  status.damaged_tiles = reply.damaged_tiles();
  status.store_bytes = reply.store_bytes();
  status.tile_bytes = reply.tile_bytes();
  status.keyframe_bytes = reply.keyframe_bytes();
  status.cells = reply.cells();
  status.multilayer_cells = reply.multilayer_cells();
  status.rss_bytes = reply.rss_bytes();
  status.compacted = reply.compacted();
  status.used_bytes = reply.used_bytes();
  status.store_limit_bytes = reply.store_limit_bytes();
  if (reply.has_disk_free_bytes()) status.disk_free_bytes = reply.disk_free_bytes();
  status.disk_floor_bytes = reply.disk_floor_bytes();
  status.refusing = reply.refusing();
  status.quarantined = reply.quarantined();
  return status;
}

SessionSummary SessionFromWire(const wire::SessionInfo& info) {
  SessionSummary session;
  session.key = {info.vehicle(), info.session()};
  session.state = info.state();
  session.keyframes = info.keyframes();
  session.bytes = info.bytes();
  session.first_time_ms = info.first_time_ms();
  session.last_time_ms = info.last_time_ms();
  session.last_sequence = info.last_sequence();
  session.compacted = info.compacted();
  session.reason = info.reason();
  session.is_damaged = info.damaged();
  session.changed_revision = info.changed_revision();
  return session;
}

}  // namespace

// A sync between its request and its end.
struct SyncRest {
  SyncRest(const SyncQuery& asked, std::weak_ptr<RpcChannel> where, std::uint64_t number)
      : query(asked), channel(std::move(where)), id(number), exchange(query) {}
  SyncRest(const SyncRest&) = delete;  // the exchange refers to the query
  SyncRest& operator=(const SyncRest&) = delete;

  const SyncQuery query;
  const std::weak_ptr<RpcChannel> channel;
  const std::uint64_t id;
  SyncExchange exchange;
};

AtlasClient::AtlasClient(std::unique_ptr<RpcChannel> channel,
                         const MapProfile& profile,
                         AtlasIdentity atlas)
    : channel_(std::move(channel)), profile_(profile), atlas_(std::move(atlas)) {}
AtlasClient::AtlasClient(AtlasClient&&) noexcept = default;
AtlasClient& AtlasClient::operator=(AtlasClient&&) noexcept = default;
AtlasClient::~AtlasClient() = default;

Result<AtlasClient> AtlasClient::Connect(const ConnectionOptions& options) {
  ConnectProgress progress = ConnectAttempt(options).Continue(options.connect_timeout);
  if (!progress.client) return Error(std::move(progress.failure));
  return *std::move(progress.client);
}

Result<RegionSummary> AtlasClient::QueryRegion(const RegionQuery& query,
                                               const TileCallback& on_tile) {
  if (Status status = CheckDisc(query); !status.ok()) return Error(std::move(status));
  if (Status status = CheckPast(query.at_revision); !status.ok()) return Error(std::move(status));
  const milliseconds extra = query.at_revision ? query.at_timeout : milliseconds(0);
  wire::Envelope request = RegionRequest(query);
  const Result<std::uint64_t> id = channel_->Send(request);
  if (!id) return Error(id.error());
  while (true) {
    Result<wire::Envelope> reply = channel_->ReceiveFor(*id, Body::kTile, Body::kQueryEnd, extra);
    if (!reply) return Error(reply.error());
    if (reply->has_query_end()) return SummaryFromWire(reply->query_end());
    Result<TileBlob> tile = TileFromWire(*reply->mutable_tile());
    if (!tile) return Error(channel_->Break(tile.error()));
    if (Status status = on_tile(*std::move(tile)); !status.ok()) return Error(std::move(status));
  }
}

Status AtlasClient::CheckMinor(std::uint32_t needed, const char* what) const {
  if (atlas_.protocol_minor >= needed) return {};
  return {StatusCode::kUnsupported,
          StrCat("the daemon speaks protocol ", kProtocolMajor, '.', atlas_.protocol_minor, ", ",
                 what, " needs ", kProtocolMajor, '.', needed)};
}

Result<SyncSummary> AtlasClient::Sync(const SyncQuery& query, const TileCallback& on_tile) {
  if (Status status = CheckMinor(kMinorWithSync, "a sync"); !status.ok())
    return Error(std::move(status));
  Result<wire::Envelope> request = SyncRequestOf(query);
  if (!request) return Error(request.error());
  const Clock::time_point latest = EndAfter(query.give_up);
  const Result<std::uint64_t> id = channel_->Send(*request, latest);
  if (!id) return Error(id.error());
  return Follow(std::make_shared<SyncRest>(query, channel_, *id), latest, on_tile);
}

Result<SyncSummary> AtlasClient::Continue(std::shared_ptr<SyncRest> rest,
                                          milliseconds give_up,
                                          const TileCallback& on_tile) {
  if (rest == nullptr || rest->channel.lock() != channel_ || rest->id != channel_->last_call()) {
    return Error(StatusCode::kNotFound, "sync: nothing of it is on its way here any more");
  }
  return Follow(std::move(rest), EndAfter(give_up), on_tile);
}

Result<SyncSummary> AtlasClient::Follow(std::shared_ptr<SyncRest> rest,
                                        Clock::time_point latest,
                                        const TileCallback& on_tile) {
  SyncExchange& exchange = rest->exchange;
  while (true) {
    const auto reply = channel_->PollFor(rest->id, rest->query.timeout, latest);
    if (!reply) return Error(reply.error());
    if (!*reply) {
      SyncSummary came = exchange.so_far();
      came.rest = std::move(rest);
      return came;
    }
    const wire::Envelope& frame = **reply;
    const std::uint64_t frame_bytes = channel_->last_frame_bytes();
    Status status;
    if (frame.has_sync_end()) {
      Result<SyncSummary> summary = exchange.OnEnd(frame.sync_end(), frame_bytes);
      if (!summary) return Error(channel_->Break(summary.error()));
      return summary;
    }
    if (frame.has_sync_manifest()) {
      status = exchange.OnManifest(frame.sync_manifest(), frame_bytes);
    } else if (frame.has_tile()) {
      Result<TileBlob> tile = exchange.OnTile(frame.tile(), frame_bytes);
      status = tile ? on_tile(*std::move(tile)) : tile.error();
    } else {
      status = channel_->Unexpected(frame);
    }
    if (status.code() == StatusCode::kInvalidData) return Error(channel_->Break(std::move(status)));
    if (!status.ok()) return Error(std::move(status));
  }
}

Result<AtlasWatch> AtlasClient::Watch(const WatchQuery& query, milliseconds timeout) {
  if (Status status = CheckMinor(kMinorWithWatch, "a watch"); !status.ok())
    return Error(std::move(status));
  return AtlasWatch::Begin(channel_, query, Clock::now() + timeout);
}

Result<AtlasStatus> AtlasClient::ReadStatus() {
  wire::Envelope request;
  request.mutable_status_request();
  const auto reply = channel_->Call(request, Body::kStatusReply);
  if (!reply) return Error(reply.error());
  return StatusFromWire(reply->status_reply());
}

Result<std::vector<SessionSummary>> AtlasClient::ListSessions(const std::string& vehicle,
                                                              SessionDetail detail) {
  const bool is_with_changes = detail == SessionDetail::kChanges;
  if (is_with_changes) {
    Status status = CheckMinor(kMinorWithChanges, "when sessions changed");
    if (!status.ok()) return Error(std::move(status));
  }
  std::vector<SessionSummary> sessions;
  SessionKey last{vehicle, {}};
  while (true) {
    wire::Envelope request;
    wire::SessionsRequest& page = *request.mutable_sessions_request();
    page.set_after_vehicle(last.vehicle);
    page.set_after_session(last.session);
    page.set_changed(is_with_changes);
    const auto reply = channel_->Call(request, Body::kSessionsReply);
    if (!reply) return Error(reply.error());
    const SessionKey before = last;
    for (const wire::SessionInfo& info : reply->sessions_reply().sessions()) {
      SessionSummary session = SessionFromWire(info);
      // A daemon that knows no pages begins with the first of all.
      if (session.key.vehicle < vehicle) continue;
      if (!vehicle.empty() && session.key.vehicle > vehicle) return sessions;
      if (session.key <= last) {
        return Error(StatusCode::kInvalidData,
                     StrCat("sessions: the daemon told of ", session.key, " behind ", last,
                            ", expected them in order"));
      }
      last = session.key;
      sessions.push_back(std::move(session));
    }
    if (!reply->sessions_reply().has_more()) return sessions;
    if (last == before) {
      return Error(StatusCode::kInvalidData, "sessions: the daemon has more of them and told none");
    }
  }
}

// A daemon that does not know the field would answer with the atlas as it is.
Status AtlasClient::CheckPast(const std::optional<std::uint64_t>& at_revision) const {
  return at_revision ? CheckMinor(kMinorWithPast, "reading an earlier revision") : Status();
}

bool AtlasClient::is_broken() const {
  return channel_->is_broken();
}

milliseconds AtlasClient::retry_after() const {
  return channel_->retry_after();
}

milliseconds AtlasClient::retry_after_of_reads() const {
  return channel_->retry_after_of_reads();
}

std::uint64_t AtlasClient::bytes_sent() const {
  return channel_->connection().bytes_sent();
}

std::uint64_t AtlasClient::bytes_received() const {
  return channel_->connection().bytes_received();
}

}  // namespace atlas
