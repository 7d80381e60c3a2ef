// `atlas watch`: what changes in an area, a line a tile, as the daemon tells it.
#include <chrono>

#include "client/cli/commands/map/map_commands.h"
#include "client/connection/atlas_watch.h"
#include "core/base/str_cat.h"

namespace atlas {
namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

// It listens again and again, and says nothing of it.
constexpr milliseconds kLookAgain{60'000};

class WatchCommand : public Command {
 public:
  std::string Name() const override { return "watch"; }
  std::string Summary() const override { return "What changes in an area, as it changes"; }

  void Declare(ArgumentSet& arguments) override {
    arguments.Required("--center", "X,Y", center_m_, "Middle of the area, metres");
    arguments.Required("--radius", "R", radius_m_, "Radius of the area, metres");
    arguments.Optional("--level", "L", level_, "Finest level told; 0 is the finest there is [0]");
    arguments.Optional("--interval", "S", interval_, "Told at most once in this time [1]");
    arguments.Optional("--for", "S", time_, "How long [until it is interrupted]");
  }

  Status Run(CommandContext& context) override {
    Result<AtlasClient> client = context.Connect();
    if (!client) return client.error();
    if (level_ >= client->profile().levels) {
      return {
          StatusCode::kInvalidArgument,
          StrCat("level ", level_, ": this atlas has levels 0 to ", client->profile().levels - 1)};
    }
    WatchQuery query;
    query.area = DiscArea{center_m_, radius_m_};
    query.finest_level = static_cast<std::uint8_t>(level_);
    query.interval = interval_;
    Result<AtlasWatch> watch = client->Watch(query, context.connection.request_timeout);
    if (!watch) return watch.error();
    Status begun = Begin(*watch, context);
    return begun.ok() ? Follow(*watch, context) : begun;
  }

 private:
  static Status Begin(AtlasWatch& watch, const CommandContext& context) {
    const auto first = watch.Next(context.connection.request_timeout);
    if (!first) return first.error();
    if (!*first) return {StatusCode::kTimeout, "watch: the daemon does not begin it"};
    if (context.is_json) {
      context.PrintJson({{"type", "begin"}, {"revision", *watch.since()}});
    } else {
      context.out << "from revision " << *watch.since() << " on" << '\n' << std::flush;
    }
    Print(**first, context);
    return {};
  }

  Status Follow(AtlasWatch& watch, const CommandContext& context) const {
    const Clock::time_point end = time_ ? Clock::now() + *time_ : Clock::time_point::max();
    while (Clock::now() < end) {
      const auto left = time_ ? std::chrono::ceil<milliseconds>(end - Clock::now()) : kLookAgain;
      const auto changes = watch.Next(std::min(left, kLookAgain));
      if (!changes) return changes.error();
      if (*changes) Print(**changes, context);
    }
    return {};
  }

  static void Print(const AreaChanges& changes, const CommandContext& context) {
    for (const auto& [id, revision] : changes.changed) {
      PrintTile("changed", id, revision, context);
    }
    for (const TileId& id : changes.removed) {
      PrintTile("removed", id, changes.revision, context);
    }
    for (const TileId& id : changes.below) {
      PrintTile("below", id, changes.revision, context);
    }
    if (!changes.is_anything) return;
    if (context.is_json) {
      context.PrintJson({{"type", "anything"}, {"revision", changes.revision}});
    } else {
      context.out << "revision " << changes.revision << "  anything" << '\n' << std::flush;
    }
  }

  static void PrintTile(const char* type,
                        const TileId& id,
                        std::uint64_t revision,
                        const CommandContext& context) {
    if (context.is_json) {
      context.PrintJson(
          {{"type", type}, {"level", id.level}, {"x", id.x}, {"y", id.y}, {"revision", revision}});
    } else {
      context.out << "revision " << revision << "  " << type << ' ' << id << '\n' << std::flush;
    }
  }

  Eigen::Vector2d center_m_ = Eigen::Vector2d::Zero();
  double radius_m_ = 0.0;
  std::uint32_t level_ = 0;
  milliseconds interval_{1'000};
  std::optional<milliseconds> time_;
};

}  // namespace

std::unique_ptr<Command> MakeWatchCommand() {
  return std::make_unique<WatchCommand>();
}

}  // namespace atlas
