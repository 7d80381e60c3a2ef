// A vehicle with the real daemon: links, stores, and the atlas as somebody else sees it.
#pragma once

#include <array>
#include <fstream>
#include <map>
#include <sstream>
#include <stdexcept>
#include <string>

#include "client/vehicle/atlas_view.h"
#include "client/vehicle/store_sync.h"
#include "tests/client/end_to_end/end_to_end_fixture.h"
#include "tests/client/support/link_proxy.h"

namespace atlas {

using HashById = std::map<TileId, std::uint64_t>;

class VehicleTest : public EndToEndTest {
 protected:
  static AtlasClient Connect(const Endpoint& endpoint) {
    ConnectionOptions options;
    options.endpoint = endpoint;
    auto client = AtlasClient::Connect(options);
    if (!client) throw std::runtime_error(client.error().message());
    return *std::move(client);
  }
  static AtlasClient Connect(const DaemonProcess& daemon) {
    return Connect(*Endpoint::Parse(daemon.address()));
  }
  // A link that breaks when so many bytes came from the daemon.
  static LinkPlan CutAfter(std::int64_t bytes, LinkCut::Kind kind = LinkCut::Kind::kClose) {
    return {.down = {.after_bytes = bytes, .kind = kind}};
  }
  static AtlasLink LinkTo(const Endpoint& endpoint) {
    LinkOptions options;
    options.connection.endpoint = endpoint;
    return AtlasLink(options);
  }
  static TileStore StoreFor(const AtlasClient& client, const fs::path& folder = {}) {
    return *TileStore::Open({client.atlas().atlas_id, client.profile()}, {.folder = folder});
  }
  static void Fill(const DaemonProcess& daemon) {
    ASSERT_EQ(Ingest(daemon).exit_code, 0);
    ASSERT_EQ(RunAtlas(daemon.address(), {"wait"}).exit_code, 0);
  }

  // The atlas as a query without anything held tells it.
  static HashById AtlasNow(AtlasClient& client) {
    HashById tiles;
    const auto end = client.QueryRegion({}, [&](const TileBlob& tile) {
      tiles[tile.id] = tile.payload_hash;
      return Status();
    });
    EXPECT_TRUE(end);
    return tiles;
  }
  static HashById Held(TileStore& store) {
    HashById tiles;
    for (const TileId& id : store.Tiles()) {
      EXPECT_TRUE(store.Read(id)) << id;
      tiles[id] = store.Find(id)->payload_hash;
    }
    return tiles;
  }

  static SyncQuery Everywhere() {
    SyncQuery query;
    query.area = DiscArea{{0.0, 0.0}, 1e6};
    return query;
  }

  // The pose of a scan of the drive, moved along x.
  static QuantizedPose PoseOf(int scan, double dx_m) {
    std::ifstream in(shared_drive / "poses.txt");
    std::string line;
    for (int i = 0; i <= scan; ++i) {
      std::getline(in, line);
    }
    std::istringstream text(line);
    std::array<double, 12> numbers{};
    for (double& number : numbers) {
      text >> number;
    }
    numbers[3] += dx_m;
    return QuantizedPose::FromPose(*PoseFromRowMajor(numbers));
  }
};

}  // namespace atlas
