// A daemon that says anything, over loopback, to a client that makes every call there is: each call
// ends, and what it returns is what it may be.
#include <chrono>

#include "client/connection/atlas_client.h"
#include "client/connection/keyframe_uploader.h"
#include "client/vehicle/tile_store.h"
#include "core/tile/tile_codec.h"
#include "tests/fuzz/support/frame_packing.h"
#include "tests/fuzz/support/loopback.h"
#include "tests/fuzz/support/reply_seeds.h"
#include "tests/fuzz/support/tile_packing.h"

namespace atlas::fuzz {
namespace {

using std::chrono::milliseconds;

const KeyframeKey kKey{{"bus", "day"}, 1};

std::vector<Bytes> Seeds() {
  return {FramesOf(ReplySeeds())};
}

ReciteServer& Daemon() {
  static ReciteServer server;
  return server;
}

ConnectionOptions Options() {
  ConnectionOptions options;
  options.endpoint = {"127.0.0.1", Daemon().port()};
  options.resume = kKey.session;
  options.connect_timeout = milliseconds(5'000);
  options.request_timeout = milliseconds(5'000);
  options.max_retry_after = milliseconds(1);
  return options;
}

// What a vehicle does with a sync: everything that comes goes into its store.
void Sync(AtlasClient& client) {
  const HeldSeed held = HeldTileSeed();
  auto store = TileStore::Open({Bytes(16, 'a'), client.profile()}, {}).value();
  const TileId held_id = TileId::FromKey(held.key).value();
  static_cast<void>(
      store.Put({held_id, 1, held.payload_hash, held.blob}));  // not of another profile
  SyncQuery query;
  query.area = DiscArea{{0.0, 0.0}, 100.0};
  query.takes_deltas = true;
  query.held = {{kEverySection, {{held_id, held.payload_hash}}, {{0x000c000000000000, 2, 3}}}};
  const auto summary = client.Sync(query, [&](const TileBlob& tile) {
    const Status put = store.Put(tile);
    Require(!put.ok() || store.Read(tile.id).has_value(), "a tile that was put can be read");
    return Status();
  });
  if (summary) {
    store.Apply(*summary);
    HeldInPart in_part;
    static_cast<void>(store.Held(query.area, 0, 5, in_part));
  }
}

void Query(AtlasClient& client) {
  const auto summary = client.QueryRegion({}, [&](const TileBlob& tile) {
    const auto decoded = DecodeTile(tile.blob, client.profile());
    return decoded ? Status() : decoded.error();
  });
  static_cast<void>(summary);
}

// True when the last call but one went as it should.
bool CallAll(AtlasClient& client) {
  Sync(client);
  Query(client);
  static_cast<void>(client.ReadStatus());
  static_cast<void>(client.ListSessions());
  static_cast<void>(client.ListKeyframes(kKey.session));
  static_cast<void>(client.WaitUntilFused(milliseconds(1)));
  static_cast<void>(client.Digest(milliseconds(1)));
  static_cast<void>(client.Verify(false, milliseconds(1)));
  static_cast<void>(client.Compact(1, "me", milliseconds(1)));
  static_cast<void>(client.Backup("it", "me", milliseconds(1), [](const BackupStage&) {}));
  static_cast<void>(client.ChangeSession(kKey.session, SessionAction::kRetract, "me"));
  const std::vector<PoseCorrection> corrections{{kKey, {}}};
  const bool is_corrected = client.UpdatePoses(corrections, "me").has_value();
  std::uint64_t last = 0;
  static_cast<void>(
      client.ReadKeyframes(kKey.session, std::nullopt, [&last](const SessionKeyframe& keyframe) {
        Require(last == 0 || keyframe.sequence >= last, "keyframes come in order");
        Require(keyframe.damage.empty() || keyframe.blob.empty(),
                "nothing is told of damaged ones");
        last = keyframe.sequence + std::uint64_t{1};
        return Status();
      }));
  static_cast<void>(client.UndoPoses(1, "me"));
  UploadOptions upload;
  upload.patience = milliseconds(2);
  KeyframeUploader uploader(client, upload);
  const Bytes blob{1, 2, 3};
  for (std::uint32_t i = 0; i < 2; ++i) {
    if (!uploader.Upload({{kKey.session, i}, 1, {}, blob}).ok()) {
      return is_corrected;
    }
  }
  static_cast<void>(uploader.Finish());
  return is_corrected;
}

bool Run(ByteSpan replies) {
  Daemon().SetText(replies);
  auto client = AtlasClient::Connect(Options());
  if (!client) {
    return false;
  }
  Require(client->profile().Validate().ok(), "an atlas has a profile that is one");
  return CallAll(*client);
}

Bytes Mutate(ByteSpan input, std::size_t max_size, Random& random) {
  return MutateFrames(input, max_size, random, &MutateWireBlob);
}

}  // namespace

const Target kTarget{&Seeds, &Run, &Mutate};

}  // namespace atlas::fuzz
