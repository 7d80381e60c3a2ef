// `atlas plan`: a route over the map's surfaces.
#include <chrono>
#include <optional>
#include <utility>

#include "client/cli/commands/map/map_commands.h"
#include "client/cli/commands/map/plan_flags.h"
#include "client/cli/commands/map/route_text.h"
#include "client/cli/files/whole_file.h"
#include "client/cli/map_input/opened_map.h"
#include "client/cli/output/json_text.h"
#include "client/cli/output/text_table.h"
#include "client/map/arena.h"
#include "client/map/map_view.h"
#include "client/score/cpu_timer.h"
#include "core/base/str_cat.h"
#include "core/planning/plan_route.h"

namespace atlas {
namespace {

// Lends the view's tiles to the planner, one at a time.
class ViewTiles : public TileSource {
 public:
  explicit ViewTiles(MapView& view) : view_(view) {}

  Result<const Tile*> Get(const TileId& id) override {
    auto tile = view_.Get(id);
    if (!tile) return Error(tile.error());
    lent_ = *std::move(tile);
    return lent_.get();
  }

 private:
  MapView& view_;
  std::shared_ptr<const Tile> lent_;
};

// Null: this vehicle may stand nowhere near.
boost::json::value EndJson(const std::optional<RouteEnd>& end) {
  return end ? boost::json::value(RouteEndJson(*end)) : nullptr;
}

boost::json::object RouteJson(const Route& route, double clearance_reach_m, double ms) {
  boost::json::array waypoints;
  boost::json::array clearances;
  boost::json::array slopes;
  for (std::size_t i = 0; i < route.waypoints.size(); ++i) {
    const Eigen::Vector3d& p = route.waypoints[i];
    waypoints.push_back({Rounded(p.x(), 3), Rounded(p.y(), 3), Rounded(p.z(), 3)});
    clearances.push_back(Rounded(route.clearance_m[i], 3));
    slopes.push_back(Rounded(route.slope_deg[i], 3));
  }
  return {{"found", route.found},
          {"start", EndJson(route.start)},
          {"goal", EndJson(route.goal)},
          {"length_m", Rounded(route.length_m, 3)},
          {"cost", Rounded(route.cost, 3)},
          {"searched_cost", Rounded(route.searched_cost, 3)},
          {"waypoints", std::move(waypoints)},
          {"clearance_m", std::move(clearances)},
          {"clearance_reach_m", Rounded(clearance_reach_m, 3)},
          {"slope_deg", std::move(slopes)},
          {"tiles_loaded", route.tiles_loaded},
          {"expansions", route.expansions},
          {"ms", Rounded(ms, 3)}};
}

void PrintRoute(const Route& route, double ms, double cell_m, std::ostream& out) {
  TextTable table({">x m", ">y m", ">z m", ">clearance m", ">slope deg"});
  for (std::size_t i = 0; i < route.waypoints.size(); ++i) {
    const Eigen::Vector3d& p = route.waypoints[i];
    table.Row({FixedText(p.x(), 2), FixedText(p.y(), 2), FixedText(p.z(), 2),
               FixedText(route.clearance_m[i], 2), FixedText(route.slope_deg[i], 1)});
  }
  if (!route.waypoints.empty()) table.Print(out);
  for (const auto& [name, end] : {std::pair("start", &route.start), {"goal", &route.goal}}) {
    if (*end && (*end)->IsMoved(cell_m)) out << name << ' ' << MoveText(**end) << '\n';
  }
  out << (route.found ? StrCat("route of ", FixedText(route.length_m, 1), " m")
                      : std::string("no route"))
      << ", " << route.tiles_loaded << " tiles loaded, " << FixedText(ms, 0) << " ms CPU\n";
}

// Whether it is the map or the vehicle, nobody can tell without planning for another one.
Status NoRoute(const Route& route, const PlanOptions& vehicle) {
  const std::string why = route.start && route.goal
                              ? std::string("what start and goal stand on is not joined,")
                              : StrCat("nowhere within ", vehicle.snap_radius_m, " m of the ",
                                       route.start ? "goal" : "start", " is room");
  return {
      StatusCode::kNotFound,
      StrCat("no route: ", why, " for a vehicle ", vehicle.vehicle_width_m,
             " m wide (--width) with ", vehicle.safety_margin_m,
             " m to each side (--margin) that needs ", vehicle.headroom_m,
             " m of height (--headroom) and drives slopes of ", vehicle.max_slope_deg,
             " degrees (--max-slope-deg)",
             vehicle.allow_unknown
                 ? ""
                 : " and only over what was found free (--allow-unknown: over all that was seen)")};
}

class PlanCommand : public Command {
 public:
  std::string Name() const override { return "plan"; }
  std::string Summary() const override { return "A drivable route between two places"; }
  bool ReadsAtlasFiles() const override { return true; }

  void Declare(ArgumentSet& arguments) override {
    arguments.Required("--from", "X,Y,Z", request_.from, "Start, metres; Z names the surface");
    arguments.Required("--to", "X,Y,Z", request_.to, "Goal, metres");
    arguments.Optional("-o,--output", "FILE", file_,
                       "Also as a file: .geojson (map frame, metres) or .csv");
    DeclarePlanFlags(arguments, request_.options, memory_mib_);
  }

  Status Run(CommandContext& context) override {
    RouteFormat format{};
    if (!file_.empty()) {
      const auto named = RouteFormatOf(file_);
      if (!named) return named.error();
      format = *named;
      ATLAS_RETURN_IF_ERROR(CheckPlace(file_));
    }
    request_.options.max_memory_bytes = std::size_t{memory_mib_} << 20;
    request_.now_s = [] {
      return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch())
          .count();
    };
    Arena memory;
    request_.memory = &memory;
    const Result<OpenedMap> map = OpenedMap::Open(context);
    if (!map) return map.error();
    MapView view(map->source());
    ViewTiles tiles(view);
    const CpuTimer timer;
    Result<Route> route = PlanRoute(tiles, map->profile(), request_);
    const double ms = 1e3 * timer.elapsed_s();
    Status failure;
    if (!route) {
      // Nothing to stand on at either end is no route as well.
      if (route.error().code() != StatusCode::kNotFound) return route.error();
      failure = route.error();
      route = Route();
    }
    if (!file_.empty() && route->found) {
      const std::string text =
          RouteText(*route, format, RouteAtlasOf(map->atlas_id(), map->profile()),
                    map->profile().cell_size_m());
      ATLAS_RETURN_IF_ERROR(WriteWholeFile(file_, Bytes(text.begin(), text.end())));
    }
    if (context.is_json) {
      context.PrintJson(RouteJson(*route, request_.options.clearance_reach_m(), ms));
    } else {
      PrintRoute(*route, ms, map->profile().cell_size_m(), context.out);
    }
    if (failure.ok() && !route->found) {
      failure = NoRoute(*route, request_.options);
    }
    return failure;
  }

 private:
  PlanRequest request_;
  std::uint32_t memory_mib_ = 512;
  std::string file_;
};

}  // namespace

std::unique_ptr<Command> MakePlanCommand() {
  return std::make_unique<PlanCommand>();
}

}  // namespace atlas
