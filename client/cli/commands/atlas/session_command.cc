// `atlas session retract V/S` and `atlas session restore V/S`: a drive out of the map and back;
// `publish V/S`: a staged one into it; `release V/S`: out of quarantine for good; `purge V/S`:
// deleted.
// `atlas vehicle retract V` and `restore V`: all its drives.
#include "client/cli/commands/atlas/atlas_commands.h"
#include "client/cli/commands/atlas/author_flag.h"
#include "core/base/str_cat.h"

namespace atlas {
namespace {

// Who does it, and why.
struct Account {
  AuthorFlag author;
  std::string reason;

  void Declare(ArgumentSet& arguments) {
    author.Declare(arguments);
    arguments.Optional("--reason", "TEXT", reason,
                       "Why, for `atlas log`: one line of at most 256 bytes");
  }
};

class SessionCommand : public Command {
 public:
  SessionCommand(std::string word, std::string summary, SessionAction action)
      : word_(std::move(word)), summary_(std::move(summary)), action_(action) {}

  std::string Name() const override { return "session " + word_; }
  std::string Summary() const override { return summary_; }

  void Declare(ArgumentSet& arguments) override {
    arguments.Required("SESSION", "VEHICLE/SESSION", session_, "As `atlas sessions` lists it");
    account_.Declare(arguments);
    if (is_purge()) {
      arguments.Flag("--yes", is_sure_, "Needed: what is deleted does not come back");
    }
  }

  Status Run(CommandContext& context) override {
    if (is_purge() && !is_sure_) {
      return {StatusCode::kInvalidArgument,
              StrCat("session ", session_, ": a purge deletes it for good; say --yes")};
    }
    const Result<std::string> author = account_.author.Author("atlas-session-" + word_);
    if (!author) return author.error();
    Result<AtlasClient> client = context.Connect();
    if (!client) return client.error();
    const auto done = client->ChangeSession(session_, action_, *author, account_.reason);
    if (!done) return done.error();
    Print(session_, *done, context);
    return {};
  }

 private:
  static void Print(const SessionKey& key,
                    const SessionChangeSummary& done,
                    const CommandContext& context) {
    if (context.is_json) {
      context.PrintJson({{"vehicle", key.vehicle},
                         {"session", key.session},
                         {"state", done.state},
                         {"changed", done.is_changed},
                         {"tiles_marked", done.tiles_marked},
                         {"revision", done.revision},
                         {"keyframes_deleted", done.keyframes}});
    } else {
      context.out << StrCat(key) << (done.is_changed ? " is " : " was already ") << done.state
                  << ", " << done.tiles_marked << " tiles to be fused again, revision "
                  << done.revision;
      if (done.keyframes > 0) {
        context.out << ", " << done.keyframes << " keyframes deleted";
      }
      context.out << '\n';
    }
  }
  bool is_purge() const { return action_ == SessionAction::kPurge; }

  std::string word_;
  std::string summary_;
  SessionAction action_;
  SessionKey session_;
  Account account_;
  bool is_sure_ = false;
};

class VehicleCommand : public Command {
 public:
  VehicleCommand(std::string word, std::string summary, SessionAction action)
      : word_(std::move(word)), summary_(std::move(summary)), action_(action) {}

  std::string Name() const override { return "vehicle " + word_; }
  std::string Summary() const override { return summary_; }

  void Declare(ArgumentSet& arguments) override {
    arguments.Required("VEHICLE", "VEHICLE", vehicle_, "As `atlas sessions` lists it");
    account_.Declare(arguments);
  }

  Status Run(CommandContext& context) override {
    const Result<std::string> author = account_.author.Author("atlas-vehicle-" + word_);
    if (!author) return author.error();
    Result<AtlasClient> client = context.Connect();
    if (!client) return client.error();
    const auto done = client->ChangeVehicle(vehicle_, action_, *author, account_.reason);
    if (!done) return done.error();
    if (context.is_json) {
      context.PrintJson({{"vehicle", vehicle_},
                         {"sessions", done->sessions},
                         {"changed", done->is_changed},
                         {"tiles_marked", done->tiles_marked},
                         {"revision", done->revision}});
    } else {
      context.out << done->sessions << " sessions of " << vehicle_ << " changed, "
                  << done->tiles_marked << " tiles to be fused again, revision " << done->revision
                  << '\n';
    }
    return {};
  }

 private:
  std::string word_;
  std::string summary_;
  SessionAction action_;
  std::string vehicle_;
  Account account_;
};

}  // namespace

std::unique_ptr<Command> MakeSessionRetractCommand() {
  return std::make_unique<SessionCommand>("retract", "Take a session out of the map",
                                          SessionAction::kRetract);
}

std::unique_ptr<Command> MakeSessionRestoreCommand() {
  return std::make_unique<SessionCommand>("restore", "Put a retracted session back into the map",
                                          SessionAction::kRestore);
}

std::unique_ptr<Command> MakeSessionReleaseCommand() {
  return std::make_unique<SessionCommand>(
      "release", "Put a quarantined session into the map, and never quarantine it again",
      SessionAction::kRelease);
}

std::unique_ptr<Command> MakeSessionPublishCommand() {
  return std::make_unique<SessionCommand>("publish", "Put a staged session into the map",
                                          SessionAction::kPublish);
}

std::unique_ptr<Command> MakeSessionPurgeCommand() {
  return std::make_unique<SessionCommand>("purge", "Delete a session for good",
                                          SessionAction::kPurge);
}

std::unique_ptr<Command> MakeVehicleRetractCommand() {
  return std::make_unique<VehicleCommand>(
      "retract", "Take all sessions of a vehicle out of the map", SessionAction::kRetract);
}

std::unique_ptr<Command> MakeVehicleRestoreCommand() {
  return std::make_unique<VehicleCommand>("restore", "Put a vehicle's retracted sessions back",
                                          SessionAction::kRestore);
}

}  // namespace atlas
