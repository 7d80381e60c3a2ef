#include "tests/client/vehicle/sync_peer.h"

#include <algorithm>
#include <set>

#include "core/base/hash.h"
#include "core/tile/tile_container.h"
#include "core/tile/tile_delta.h"
#include "proto/wire/convert.h"
#include "tests/client/vehicle/asked_area.h"

namespace atlas {
namespace {

constexpr std::uint64_t kSpareBytes = 400;  // for a manifest of one tile and the end

SectionMask SectionsOf(const google::protobuf::RepeatedField<std::uint32_t>& numbers) {
  SectionMask sections = 0;
  for (const std::uint32_t number : numbers) {
    sections |= SectionMask{1} << number;
  }
  return sections == 0 ? kAllSections : sections;
}

// What one request holds, by tile: which sections of the current content.
class Answer {
 public:
  Answer(const TinyWorld& world, const wire::SyncRequest& request)
      : world_(world),
        request_(request),
        area_(AreaOf(request.area())),
        wanted_(SectionsOf(request.sections())) {
    for (const wire::Held& held : request.held()) {
      HearTiles(held);
      HearBlocks(held);
    }
  }

  const wire::SyncManifest& holdings() const { return holdings_; }
  // Sections to send; 0: none.
  // What is held of an earlier content, to make a delta against; 0: nothing.
  std::uint64_t BaseOf(const TileId& id) const {
    const auto found = bases_.find(id);
    return found == bases_.end() ? 0 : found->second.first;
  }
  SectionMask BaseSectionsOf(const TileId& id) const { return bases_.at(id).second; }
  SectionMask Missing(const TileId& id) const {
    if (!IsInArea(id) || suppressed_.contains(id.Key() >> 6)) return 0;
    const auto found = current_.find(id);
    return found == current_.end() ? wanted_ : wanted_ & ~found->second;
  }

 private:
  bool IsInArea(const TileId& id) const {
    if (id.level < request_.finest_level()) return false;
    return !area_ || Touches(*area_, id, TinyProfile());
  }

  void HearTiles(const wire::Held& held) {
    for (int i = 0; i < held.keys_size(); ++i) {
      const TileId id = *TileId::FromKey(held.keys(i));
      const auto found = world_.tiles().find(id);
      if (!IsInArea(id)) continue;
      if (found == world_.tiles().end()) {
        holdings_.add_removed(held.keys(i));
      } else if (found->second.encoded.payload_hash == held.payload_hashes(i)) {
        current_[id] = SectionsOf(held.sections());
      } else if (request_.takes_deltas() && world_.past_blobs().contains(held.payload_hashes(i))) {
        bases_[id] = {held.payload_hashes(i), SectionsOf(held.sections())};
      }
    }
  }

  void HearBlocks(const wire::Held& held) {
    for (int i = 0; i < held.blocks_size(); ++i) {
      ByteWriter content;
      std::uint64_t mask = 0;
      bool is_in_area = false;
      for (std::uint64_t key = held.blocks(i) << 6; key >> 6 == held.blocks(i); ++key) {
        const TileId id = *TileId::FromKey(key);
        const bool is_held = (held.masks(i) >> (key & 63) & 1) != 0;
        const auto found = world_.tiles().find(id);
        is_in_area |= is_held && IsInArea(id);
        if (!is_held || found == world_.tiles().end()) continue;
        mask |= std::uint64_t{1} << (key & 63);
        content.U64(key);
        content.U64(found->second.encoded.payload_hash);
        current_[id] = SectionsOf(held.sections());
      }
      const bool is_same = mask == held.masks(i) && Hash64(content.bytes()) == held.digests(i);
      if (is_same || !is_in_area) continue;
      holdings_.add_differing_blocks(held.blocks(i));
      suppressed_.insert(held.blocks(i));
    }
  }

  const TinyWorld& world_;
  const wire::SyncRequest& request_;
  std::optional<MapArea> area_;
  SectionMask wanted_;
  std::map<TileId, SectionMask> current_;
  std::map<TileId, std::pair<std::uint64_t, SectionMask>> bases_;
  std::set<std::uint64_t> suppressed_;
  wire::SyncManifest holdings_;
};

wire::Envelope TileOf(const TileId& id, const TinyWorld::Stored& stored, SectionMask sections) {
  wire::Envelope envelope;
  wire::TileMessage& tile = *envelope.mutable_tile();
  tile.set_key(id.Key());
  tile.set_revision(stored.revision);
  tile.set_payload_hash(stored.encoded.payload_hash);
  tile.set_blob(BytesToWire(*SelectSections(stored.encoded.blob, sections)));
  return envelope;
}

void MakeDelta(const TinyWorld& world,
               const Answer& answer,
               const TileId& id,
               wire::TileMessage& tile) {
  tile.set_base_hash(answer.BaseOf(id));
  if (tile.base_hash() == 0) return;
  const Bytes base =
      *SelectSections(world.past_blobs().at(tile.base_hash()), answer.BaseSectionsOf(id));
  tile.set_blob(BytesToWire(*EncodeTileDelta(base, BytesFromWire(tile.blob()))));
}

void Announce(const wire::TileMessage& tile, wire::SyncManifest& manifest) {
  manifest.add_keys(tile.key());
  manifest.add_revisions(tile.revision());
  manifest.add_payload_hashes(tile.payload_hash());
  manifest.add_bytes(static_cast<std::uint32_t>(tile.blob().size()));
}

std::uint64_t FrameBytes(wire::Envelope envelope, std::uint64_t id) {
  envelope.set_request_id(id);
  return EncodeEnvelopeFrame(envelope)->size();
}

struct Position {
  std::uint64_t key = ~std::uint64_t{0};  // of the last tile: keys fall, coarse first
  std::uint64_t revision = 0;             // of the world when the first reply began
};

Position PositionFrom(const wire::SyncRequest& request, const TinyWorld& world) {
  if (request.cursor().empty()) return {~std::uint64_t{0}, world.revision()};
  ByteReader in(BytesFromWire(request.cursor()));
  const std::uint64_t key = in.U64();
  return {key, in.U64()};
}

std::vector<TileId> CoarseFirst(const TinyWorld& world) {
  std::vector<TileId> ids;
  for (const auto& [id, stored] : world.tiles()) {
    ids.push_back(id);
  }
  std::sort(ids.begin(), ids.end(),
            [](const TileId& a, const TileId& b) { return a.Key() > b.Key(); });
  return ids;
}

// All frames of a reply, the end last.
std::vector<wire::Envelope> Reply(const TinyWorld& world, const wire::Envelope& envelope) {
  const wire::SyncRequest& request = envelope.sync_request();
  const Answer answer(world, request);
  Position position = PositionFrom(request, world);
  std::vector<wire::Envelope> frames(1);
  *frames[0].mutable_sync_manifest() = answer.holdings();
  std::uint64_t bytes = FrameBytes(frames[0], envelope.request_id());
  std::uint32_t tiles = 0;
  bool is_cut = false;
  for (const TileId& id : CoarseFirst(world)) {
    const TinyWorld::Stored& stored = world.tiles().at(id);
    const SectionMask sections = answer.Missing(id);
    const bool is_due = id.Key() < position.key || stored.revision > position.revision;
    if (sections == 0 || !is_due) continue;
    std::vector<wire::Envelope> pair(2);
    pair[1] = TileOf(id, stored, sections);
    MakeDelta(world, answer, id, *pair[1].mutable_tile());
    Announce(pair[1].tile(), *pair[0].mutable_sync_manifest());
    const std::uint64_t more =
        FrameBytes(pair[0], envelope.request_id()) + FrameBytes(pair[1], envelope.request_id());
    is_cut = request.budget_bytes() != 0 && bytes + more + kSpareBytes > request.budget_bytes();
    if (is_cut) break;
    bytes += more;
    ++tiles;
    position.key = std::min(position.key, id.Key());
    frames.insert(frames.end(), pair.begin(), pair.end());
  }
  wire::SyncEnd& end = *frames.emplace_back().mutable_sync_end();
  end.set_tiles(tiles);
  end.set_revision(world.revision());
  ByteWriter cursor;
  cursor.U64(position.key);
  cursor.U64(position.revision);
  if (is_cut) end.set_cursor(BytesToWire(cursor.bytes()));
  std::uint64_t total = bytes + FrameBytes(frames.back(), envelope.request_id());
  for (int i = 0; i < 3; ++i) {
    end.set_bytes(total);
    total = bytes + FrameBytes(frames.back(), envelope.request_id());
  }
  end.set_bytes(total);
  return frames;
}

}  // namespace

SyncPeer::SyncPeer(const TinyWorld& world, int frames_until_cut)
    : world_(world),
      frames_left_(frames_until_cut),
      peer_([this](PeerSocket& socket) { Serve(socket); }) {}

void SyncPeer::Serve(PeerSocket& socket) {
  const auto hello = socket.ReadRequest();
  if (!hello) return;
  wire::Envelope greeting;
  wire::HelloReply& reply = *greeting.mutable_hello_reply();
  reply.set_protocol_major(kProtocolMajor);
  reply.set_protocol_minor(kProtocolMinor);
  reply.set_profile(ProfileToWire(TinyProfile()));
  reply.set_atlas_id(BytesToWire(TinyAtlas().atlas_id));
  {
    std::unique_lock lock(mutex_);
    released_.wait_for(lock, std::chrono::seconds(10), [this] { return !is_greeting_held_; });
  }
  socket.Reply(hello->request_id(), std::move(greeting));
  while (const auto request = socket.ReadRequest()) {
    if (AnswerWatch(socket, *request)) continue;
    ++syncs_;
    for (wire::Envelope& frame : Reply(world_, *request)) {
      if (frames_left_-- <= 0) {
        Flush(socket);
        return;
      }
      tiles_sent_ += frame.has_tile() ? 1 : 0;
      frame.set_request_id(request->request_id());
      if (!Send(socket, frame)) return;
    }
    if (!Flush(socket)) return;
  }
}

bool SyncPeer::AnswerWatch(PeerSocket& socket, const wire::Envelope& request) {
  if (!request.has_watch_request() && !request.has_cancel_request()) return false;
  const std::scoped_lock lock(mutex_);
  if (request.has_cancel_request()) {
    wire::Envelope done;
    done.mutable_cancel_reply();
    return socket.Reply(request.request_id(), std::move(done));
  }
  ++watches_asked_;
  wire::Envelope reply;
  if (watches_ == Watches::kTaken) {
    watcher_ = &socket;
    watch_id_ = request.request_id();
    reply.mutable_watch_event()->set_revision(world_.revision());
  } else {
    *reply.mutable_error() = ErrorToWire({StatusCode::kUnavailable, "too many watches"});
  }
  if (watches_ != Watches::kLeftWaiting) socket.Reply(request.request_id(), std::move(reply));
  return true;
}

void SyncPeer::SetWatches(Watches watches) {
  const std::scoped_lock lock(mutex_);
  watches_ = watches;
}

void SyncPeer::TellWatch(wire::Envelope reply) {
  const std::scoped_lock lock(mutex_);
  watcher_->Reply(watch_id_, std::move(reply));
}

void SyncPeer::TellChange(const TileId& id) {
  wire::Envelope reply;
  wire::WatchEvent& event = *reply.mutable_watch_event();
  event.set_revision(world_.revision());
  event.add_keys(id.Key());
  event.add_revisions(world_.revision());
  TellWatch(std::move(reply));
}

void SyncPeer::EndWatch() {
  wire::Envelope reply;
  *reply.mutable_error() = ErrorToWire({StatusCode::kUnavailable, "the daemon stops"});
  TellWatch(std::move(reply));
}

bool SyncPeer::Send(PeerSocket& socket, const wire::Envelope& frame) {
  const Bytes bytes = *EncodeEnvelopeFrame(frame);
  std::unique_lock lock(mutex_);
  if (frames_until_silence_-- > 0) {
    unsent_.insert(unsent_.end(), bytes.begin(), bytes.end());
    return true;
  }
  const auto half = bytes.begin() + static_cast<std::ptrdiff_t>(bytes.size() / 2);
  unsent_.insert(unsent_.end(), bytes.begin(), half);
  const bool is_sent = Flush(socket);
  released_.wait_for(lock, std::chrono::seconds(10), [this] { return frames_until_silence_ >= 0; });
  unsent_.insert(unsent_.end(), half, bytes.end());
  return is_sent;
}

void SyncPeer::FallSilentAfter(int frames) {
  const std::scoped_lock lock(mutex_);
  frames_until_silence_ = frames;
}

void SyncPeer::HoldGreeting() {
  const std::scoped_lock lock(mutex_);
  is_greeting_held_ = true;
}

void SyncPeer::Release() {
  {
    const std::scoped_lock lock(mutex_);
    is_greeting_held_ = false;
    frames_until_silence_ = kNever;
  }
  released_.notify_all();
}

}  // namespace atlas
