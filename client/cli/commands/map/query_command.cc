// `atlas query`: the tiles around a place, coarse to fine, as a stream of lines and as files.
#include <filesystem>

#include "client/cli/commands/map/map_commands.h"
#include "client/cli/files/whole_file.h"
#include "client/cli/output/text_table.h"
#include "core/base/str_cat.h"

namespace atlas {
namespace {

std::string TileFileName(const TileId& id) {
  return StrCat(int{id.level}, '_', id.x, '_', id.y, ".tile");
}

class QueryCommand : public Command {
 public:
  std::string Name() const override { return "query"; }
  std::string Summary() const override { return "The tiles around a place, coarse to fine"; }

  void Declare(ArgumentSet& arguments) override {
    arguments.Required("--center", "X,Y", center_m_, "Middle of the area, metres");
    arguments.Required("--radius", "R", radius_m_, "Radius of the area, metres");
    arguments.Optional("--level", "L", level_, "Finest level sent; 0 is the finest there is [0]");
    arguments.Optional("--budget", "BYTES", budget_bytes_, "Stop before the reply gets larger");
    arguments.Optional("--at", "REVISION", at_revision_, "As the atlas was at this revision");
    arguments.Optional("-o,--output", "DIR", directory_, "Write the tiles here, as L_X_Y.tile");
  }

  Status Run(CommandContext& context) override {
    ATLAS_RETURN_IF_ERROR(CheckArguments());
    Result<AtlasClient> client = context.Connect();
    if (!client) return client.error();
    const Result<RegionQuery> query = Query(client->profile());
    if (!query) return query.error();
    if (!directory_.empty()) ATLAS_RETURN_IF_ERROR(MakeDirectory(directory_));
    const auto summary = client->QueryRegion(*query, [&](const TileBlob& tile) {
      PrintTile(tile, context);
      return directory_.empty()
                 ? Status()
                 : WriteWholeFile(std::filesystem::path(directory_) / TileFileName(tile.id),
                                  tile.blob);
    });
    if (!summary) return summary.error();
    PrintSummary(*summary, context);
    return {};
  }

 private:
  Status CheckArguments() const {
    if (!(radius_m_ >= 0.0)) {
      return {StatusCode::kInvalidArgument, StrCat("radius ", radius_m_, " m: expected 0 or more")};
    }
    if (budget_bytes_ && *budget_bytes_ == 0) {
      return {StatusCode::kInvalidArgument, "budget 0: expected at least one byte"};
    }
    return {};
  }

  Result<RegionQuery> Query(const MapProfile& profile) const {
    if (level_ >= profile.levels) {
      return Error(StatusCode::kInvalidArgument,
                   StrCat("level ", level_, ": this atlas has levels 0 to ", profile.levels - 1));
    }
    RegionQuery query;
    query.disc = {center_m_, radius_m_};
    query.finest_level = static_cast<std::uint8_t>(level_);
    query.budget_bytes = budget_bytes_.value_or(0);
    query.at_revision = at_revision_;
    return query;
  }

  static void PrintTile(const TileBlob& tile, const CommandContext& context) {
    if (context.is_json) {
      context.PrintJson({{"type", "tile"},
                         {"level", tile.id.level},
                         {"x", tile.id.x},
                         {"y", tile.id.y},
                         {"revision", tile.revision},
                         {"bytes", tile.blob.size()}});
    } else {
      context.out << "tile " << tile.id << "  revision " << tile.revision << "  "
                  << BytesText(tile.blob.size()) << '\n';
    }
  }

  static void PrintSummary(const RegionSummary& summary, const CommandContext& context) {
    if (context.is_json) {
      context.PrintJson({{"type", "summary"},
                         {"tiles", summary.tiles},
                         {"bytes", summary.bytes},
                         {"revision", summary.revision},
                         {"truncated", summary.is_truncated}});
    } else {
      context.out << summary.tiles << " tiles, " << BytesText(summary.bytes)
                  << " received, revision " << summary.revision
                  << (summary.is_truncated ? ", cut short by the budget" : "") << '\n';
    }
  }

  Eigen::Vector2d center_m_ = Eigen::Vector2d::Zero();
  double radius_m_ = 0.0;
  std::uint32_t level_ = 0;
  std::optional<std::uint64_t> budget_bytes_;
  std::optional<std::uint64_t> at_revision_;
  std::string directory_;
};

}  // namespace

std::unique_ptr<Command> MakeQueryCommand() {
  return std::make_unique<QueryCommand>();
}

}  // namespace atlas
