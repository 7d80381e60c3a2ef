// `atlas status`: how much is in the atlas and in the daemon.
#include "client/cli/commands/atlas/atlas_commands.h"
#include "client/cli/output/text_table.h"

namespace atlas {
namespace {

boost::json::value FreeJson(const AtlasStatus& status) {
  return status.disk_free_bytes ? boost::json::value(*status.disk_free_bytes)
                                : boost::json::value(nullptr);
}

boost::json::object StatusJson(const AtlasStatus& status, const MapProfile& profile) {
  return {{"revision", status.revision},
          {"preset", FusionPresetName(profile.preset)},
          {"keyframes", status.keyframes},
          {"sessions", status.sessions},
          {"tiles", status.tiles},
          {"dirty_tiles", status.dirty_tiles},
          {"damaged_tiles", status.damaged_tiles},
          {"store_bytes", status.store_bytes},
          {"tile_bytes", status.tile_bytes},
          {"keyframe_bytes", status.keyframe_bytes},
          {"cells", status.cells},
          {"multilayer_cells", status.multilayer_cells},
          {"rss_bytes", status.rss_bytes},
          {"compacted", status.compacted},
          {"quarantined", status.quarantined},
          {"used_bytes", status.used_bytes},
          {"store_limit_bytes", status.store_limit_bytes},
          {"disk_free_bytes", FreeJson(status)},
          {"disk_floor_bytes", status.disk_floor_bytes},
          {"refusing", status.refusing}};
}

// What uploads may take, where anything bounds them.
void AddLimits(const AtlasStatus& status, FactList& facts) {
  if (status.store_limit_bytes != 0) {
    facts.Add("store limit",
              BytesText(status.used_bytes) + " in use, of " + BytesText(status.store_limit_bytes));
  }
  if (status.disk_floor_bytes != 0 && status.disk_free_bytes) {
    facts.Add("disk", BytesText(*status.disk_free_bytes) + " free, of which " +
                          BytesText(status.disk_floor_bytes) + " stay free");
  }
  if (!status.refusing.empty()) {
    facts.Add("uploads", "refused: " + status.refusing);
  }
}

void PrintStatus(const AtlasStatus& status, const MapProfile& profile, std::ostream& out) {
  FactList facts;
  facts.Add("preset", std::string(FusionPresetName(profile.preset)));
  facts.Add("revision", std::to_string(status.revision));
  facts.Add("sessions", std::to_string(status.sessions));
  if (status.quarantined != 0) {
    facts.Add("quarantined", std::to_string(status.quarantined) + " of them; see atlas sessions");
  }
  facts.Add("keyframes",
            std::to_string(status.keyframes) + ", " + BytesText(status.keyframe_bytes));
  if (status.compacted != 0) {
    facts.Add("compacted", std::to_string(status.compacted) + " more, dropped since");
  }
  facts.Add("tiles", std::to_string(status.tiles) + ", " + BytesText(status.tile_bytes));
  facts.Add("to be fused", std::to_string(status.dirty_tiles) + " tiles");
  if (status.damaged_tiles != 0) {
    facts.Add("damaged", std::to_string(status.damaged_tiles) + " of them; see atlas verify");
  }
  facts.Add("cells", std::to_string(status.cells) + ", of them " +
                         std::to_string(status.multilayer_cells) + " with several surfaces");
  facts.Add("store", BytesText(status.store_bytes));
  AddLimits(status, facts);
  facts.Add("daemon memory", BytesText(status.rss_bytes));
  facts.Print(out);
}

class StatusCommand : public Command {
 public:
  std::string Name() const override { return "status"; }
  std::string Summary() const override { return "What the atlas holds"; }
  void Declare(ArgumentSet&) override {}

  Status Run(CommandContext& context) override {
    Result<AtlasClient> client = context.Connect();
    if (!client) return client.error();
    const Result<AtlasStatus> status = client->ReadStatus();
    if (!status) return status.error();
    if (context.is_json) {
      context.PrintJson(StatusJson(*status, client->profile()));
    } else {
      PrintStatus(*status, client->profile(), context.out);
    }
    return {};
  }
};

}  // namespace

std::unique_ptr<Command> MakeStatusCommand() {
  return std::make_unique<StatusCommand>();
}

}  // namespace atlas
