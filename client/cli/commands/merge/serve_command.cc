// `atlas-merge serve`: watches a daemon and merges sessions once they are complete.
#include <chrono>
#include <numbers>
#include <optional>
#include <string>
#include <utility>

#include "client/cli/command_line/stop_signal.h"
#include "client/cli/commands/atlas/author_flag.h"
#include "client/cli/commands/merge/merge_commands.h"
#include "client/cli/commands/merge/report_folder.h"
#include "client/cli/commands/merge/serve_events.h"
#include "client/cli/commands/merge/serve_log.h"
#include "client/merge/serve/merge_service.h"
#include "core/base/str_cat.h"

namespace atlas {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

class MergeServeCommand : public Command {
 public:
  std::string Name() const override { return "serve"; }
  std::string Summary() const override {
    return "Watch a daemon, and merge staged sessions once nobody uploads to them";
  }

  void Declare(ArgumentSet& arguments) override {
    arguments.Optional("--settle", "SECONDS", options_.settle,
                       "A session is complete without an upload for so long [120]");
    arguments.Optional("--every", "SECONDS", options_.every, "Look at the daemon so often [30]");
    arguments.Flag("--once", options_.is_once,
                   "One round: what gets no upload within --settle, and no more");
    arguments.Optional("--reports", "DIR", reports_,
                       "A report of each merge applied, and of each over limits, with corrections");
    arguments.Optional("--keep-reports", "N", kept_, "The newest of them [200]");
    arguments.Optional("--work", "DIR", work_,
                       "Keep what was found there: a merge computes what is new [nothing is kept]");
    DeclareLimits(arguments);
    author_.Declare(arguments);
  }

  // Its log is on stderr as all else; with --json each line is an object.
  Status Run(CommandContext& context) override {
    ATLAS_RETURN_IF_ERROR(TakeOptions());
    std::optional<ReportFolder> reports;
    if (reports_) {
      auto opened = ReportFolder::Open(*reports_, kept_);
      if (!opened) return opened.error();
      reports = *std::move(opened);
    }
    StopSignal stop;
    ServeLog log(context.err, "atlas-merge", context.is_json);
    ServeEvents events(log, context.connection.endpoint.ToText(), std::move(reports));
    MergeService service(
        {.connection = context.connection}, options_,
        {[] { return std::chrono::steady_clock::now(); },
         [&](std::chrono::milliseconds time) { stop.Sleep(time); }, [&] { return stop.HasCome(); },
         [&](const MergeEvent& event) {
           events.Note(event);
         }});
    Status status = service.Run();
    if (stop.HasCome()) {
      log.Line(ServeLogLevel::kInfo, "stopped by a signal", {{"event", "stopped"}});
    }
    return options_.is_once && status.ok() && !stop.HasCome() ? events.refused() : status;
  }

 private:
  void DeclareLimits(ArgumentSet& arguments) {
    arguments.Optional("--max-move", "M", options_.limits.max_move_m,
                       "Apply nothing that moves a session in the map farther [0.5]");
    arguments.Optional("--max-turn-deg", "D", max_turn_deg_, "... or turns it by more [1]");
    arguments.Optional("--max-staged-move", "M", options_.limits.max_staged_move_m,
                       "... or moves a staged session farther [1000]");
    arguments.Optional("--max-tiles", "N", options_.limits.max_tiles,
                       "... or has more tiles fused again [20000]");
  }

  Status TakeOptions() {
    const Result<std::string> author = author_.Author("atlas-merge");
    if (!author) return author.error();
    options_.author = *author;
    if (work_) options_.work = *work_;
    options_.limits.max_turn_rad = kDegree * max_turn_deg_;
    ATLAS_RETURN_IF_ERROR(CheckFlags());
    return options_.Validate();
  }

  // By the names that they have here.
  Status CheckFlags() const {
    if (kept_ == 0) return {StatusCode::kInvalidArgument, "--keep-reports: expected at least 1"};
    if (options_.every.count() <= 0) {
      return {StatusCode::kInvalidArgument, "--every: expected more than 0 seconds"};
    }
    for (const auto& [flag, value] :
         {std::pair<const char*, double>{"--max-move", options_.limits.max_move_m},
          {"--max-turn-deg", max_turn_deg_},
          {"--max-staged-move", options_.limits.max_staged_move_m}}) {
      if (!(value >= 0.0)) {  // NaN, too
        return {StatusCode::kInvalidArgument, StrCat(flag, ": ", value, ", expected at least 0")};
      }
    }
    return {};
  }

  MergeServiceOptions options_;
  double max_turn_deg_ = 1.0;
  std::optional<std::string> reports_;
  std::uint32_t kept_ = 200;
  std::optional<std::string> work_;
  AuthorFlag author_;
};

}  // namespace

std::unique_ptr<Command> MakeMergeServeCommand() {
  return std::make_unique<MergeServeCommand>();
}

}  // namespace atlas
