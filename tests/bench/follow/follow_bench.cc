// A vehicle that follows a drive and asks for the map around it: what travels. JSON lines.
// Usage: follow_bench drive SERVER POSES FOLDER    with the tiles that it holds in the folder; a
//                                                  line a request
//        follow_bench discs SERVER POSES           all finest tiles of each disc, as a query sends
//        follow_bench first SERVER POSES COUNT     without a map, over a slow link, at so many
//                                                  places of the drive
//        follow_bench near SERVER POSES COUNT      the same for what planning to the next place
//                                                  takes: 25 m, without columns
//        follow_bench update SERVER POSES FOLDER   what changed of the tiles in the folder since,
//                                                  as differences and as a whole
#include <chrono>
#include <cstdlib>
#include <future>
#include <iostream>
#include <string>
#include <vector>

#include "client/vehicle/atlas_view.h"
#include "tests/bench/follow/first_map.h"
#include "tests/bench/follow/route_places.h"
#include "tests/bench/follow/store_update.h"

namespace atlas::testing {
namespace {

using Places = std::vector<Eigen::Vector3d>;

constexpr double kSpacing_m = 20.0;
constexpr double kSpeed_m_per_s = 60.0 / 3.6;
constexpr double kRadius_m = 150.0;
constexpr double kFirstRadius_m = 100.0;
constexpr double kNearRadius_m = 25.0;
constexpr SectionBits kSurface = 1U << 1U | 1U << 2U;  // and contributors

void PrintRequest(std::size_t i, const MapAround& map, std::uint64_t sent, std::uint64_t received) {
  const double at_m = kSpacing_m * static_cast<double>(i);
  std::cout << "{\"at_m\": " << at_m << ", \"at_s\": " << at_m / kSpeed_m_per_s
            << ", \"sent\": " << sent << ", \"received\": " << received
            << ", \"requests\": " << map.transfer.requests << ", \"tiles\": " << map.transfer.tiles
            << ", \"finest_places\": " << map.finest_places << "}" << std::endl;
}

Result<TileStore> OpenStore(AtlasLink& link, const std::string& folder) {
  const auto client = link.Client(std::chrono::seconds(5));
  if (!client) return Error(client.error());
  TileStoreOptions options;
  options.folder = folder;
  return TileStore::Open({(*client)->atlas().atlas_id, (*client)->profile()}, options);
}

// The handshake counts with the first request.
Status Follow(const Endpoint& daemon, const Places& places, const std::string& folder) {
  LinkOptions options;
  options.connection.endpoint = daemon;
  AtlasLink link(options);
  auto store = OpenStore(link, folder);
  if (!store) return store.error();
  AtlasView view(*store, &link);
  std::uint64_t sent = 0;
  std::uint64_t received = 0;
  for (std::size_t i = 0; i < places.size(); ++i) {
    AroundOptions around;
    around.deadline = std::chrono::seconds(60);
    const auto map = view.Around(places[i].head<2>(), kRadius_m, around);
    if (!map) return map.error();
    if (!map->is_current || !map->is_finest_everywhere()) {
      return {StatusCode::kUnavailable, "not all of the map came: " + map->sync.message()};
    }
    const auto client = link.Client(std::chrono::seconds(1));
    if (!client) return client.error();
    PrintRequest(i, *map, (*client)->bytes_sent() - sent, (*client)->bytes_received() - received);
    sent = (*client)->bytes_sent();
    received = (*client)->bytes_received();
  }
  return {};
}

Status SendDiscs(const Endpoint& daemon, const Places& places) {
  ConnectionOptions options;
  options.endpoint = daemon;
  auto client = AtlasClient::Connect(options);
  if (!client) return client.error();
  for (std::size_t i = 0; i < places.size(); ++i) {
    RegionQuery query;
    query.disc = {places[i].head<2>(), kRadius_m};
    query.is_only_finest = true;
    const auto reply = client->QueryRegion(query, [](const TileBlob&) { return Status(); });
    if (!reply) return reply.error();
    std::cout << "{\"at_m\": " << kSpacing_m * static_cast<double>(i)
              << ", \"tiles\": " << reply->tiles << ", \"received\": " << reply->bytes << "}"
              << std::endl;
  }
  return {};
}

template <typename T>
void PrintList(const char* name, const std::vector<T>& values) {
  std::cout << ", \"" << name << "\": [";
  for (std::size_t i = 0; i < values.size(); ++i) {
    std::cout << (i > 0 ? ", " : "") << values[i];
  }
  std::cout << "]";
}

void PrintFirst(const FirstMap& first) {
  std::cout << "{\"connected_s\": " << first.connected_s
            << ", \"covered_s\": " << first.covered_s.value_or(-1.0)
            << ", \"covered_bytes\": " << first.covered_bytes
            << ", \"planned_s\": " << first.planned_s.value_or(-1.0);
  PrintList("complete_s", first.complete_s);
  PrintList("tiles", first.tiles);
  PrintList("blob_bytes", first.blob_bytes);
  std::cout << "}" << std::endl;
}

// All of them at once, each over a link of its own.
Status TimeFirstMaps(FirstMapOptions options, const Places& places, std::size_t count) {
  std::vector<std::future<Result<FirstMap>>> firsts;
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t at = i * (places.size() - 2) / count;
    options.place_m = places[at];
    options.target_m = places[at + 1];
    firsts.push_back(std::async(std::launch::async, [options] { return TimeFirstMap(options); }));
  }
  Status failure;
  for (auto& future : firsts) {
    const auto first = future.get();
    if (!first) {
      failure = first.error();
    } else {
      PrintFirst(*first);
    }
  }
  return failure;
}

Status Update(const Endpoint& daemon, const Places& places, const std::string& folder) {
  BoxArea area{places.front().head<2>(), places.front().head<2>()};
  for (const Eigen::Vector3d& place : places) {
    area.min_m = area.min_m.cwiseMin(place.head<2>());
    area.max_m = area.max_m.cwiseMax(place.head<2>());
  }
  area.min_m.array() -= kRadius_m;
  area.max_m.array() += kRadius_m;
  const auto update = UpdateStore(daemon, area, folder);
  if (!update) return update.error();
  std::cout << "{\"tiles\": " << update->tiles << ", \"deltas\": " << update->deltas
            << ", \"bytes\": " << update->bytes << ", \"whole_bytes\": " << update->whole_bytes
            << "}" << std::endl;
  return {};
}

FirstMapOptions FirstOptions(const Endpoint& daemon, bool is_near) {
  FirstMapOptions options;
  options.daemon = daemon;
  options.radius_m = is_near ? kNearRadius_m : kFirstRadius_m;
  options.sections = is_near ? kSurface : kEverySection;
  return options;
}

Status Run(const std::string& what,
           const Endpoint& daemon,
           const Places& places,
           const std::string& more) {
  if (what == "drive") return Follow(daemon, places, more);
  if (what == "discs") return SendDiscs(daemon, places);
  if (what == "update") return Update(daemon, places, more);
  return TimeFirstMaps(FirstOptions(daemon, what == "near"), places,
                       std::strtoul(more.c_str(), nullptr, 10));
}

}  // namespace
}  // namespace atlas::testing

int main(int argc, char** argv) {
  const std::string what = argc > 1 ? argv[1] : "";
  const auto daemon = atlas::Endpoint::Parse(argc > 3 ? argv[2] : "");
  const bool has_more = what == "drive" || what == "first" || what == "near" || what == "update";
  if (!daemon || argc != (has_more ? 5 : 4) || (!has_more && what != "discs")) {
    std::cerr << "usage: follow_bench drive|update SERVER POSES FOLDER | discs SERVER POSES | "
                 "first|near SERVER POSES COUNT\n";
    return 2;
  }
  const auto places = atlas::testing::PlacesAlong(argv[3], atlas::testing::kSpacing_m);
  const atlas::Status status =
      places ? atlas::testing::Run(what, *daemon, *places, has_more ? argv[4] : "")
             : places.error();
  if (!status.ok()) {
    std::cerr << "follow_bench: " << status.message() << "\n";
    return 1;
  }
  return 0;
}
