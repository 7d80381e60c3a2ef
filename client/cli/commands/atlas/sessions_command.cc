// `atlas sessions`: which vehicles' drives the atlas is made of.
#include <algorithm>

#include "client/cli/commands/atlas/atlas_commands.h"
#include "client/cli/output/text_table.h"
#include "core/base/str_cat.h"

namespace atlas {
namespace {

boost::json::object SessionJson(const SessionSummary& session) {
  return {{"vehicle", session.key.vehicle},
          {"session", session.key.session},
          {"state", session.state},
          {"keyframes", session.keyframes},
          {"bytes", session.bytes},
          {"first_time_ms", session.first_time_ms},
          {"last_time_ms", session.last_time_ms},
          {"last_sequence", session.last_sequence},
          {"compacted", session.compacted},
          {"reason", session.reason},
          {"damaged", session.is_damaged}};
}

std::string StateText(const SessionSummary& session) {
  const std::string reason = session.reason.empty() ? "" : ": " + session.reason;
  return session.state + (session.compacted == 0 ? "" : ", compacted") + reason;
}

void PrintSessions(const std::vector<SessionSummary>& sessions, std::ostream& out) {
  TextTable table({"vehicle", "session", "state", ">keyframes", ">bytes", ">last sequence"});
  for (const SessionSummary& session : sessions) {
    table.Row({session.key.vehicle, session.key.session, StateText(session),
               std::to_string(session.keyframes), BytesText(session.bytes),
               std::to_string(session.last_sequence)});
  }
  table.Print(out);
}

// The list is all there is to tell; that it has damage in it is how the command ends.
Status DamageOf(const std::vector<SessionSummary>& sessions) {
  const auto damaged = std::count_if(sessions.begin(), sessions.end(),
                                     [](const SessionSummary& s) { return s.is_damaged; });
  if (damaged == 0) return {};
  return {StatusCode::kInvalidData,
          StrCat("sessions: ", damaged, " of ", sessions.size(),
                 " damaged: a session's row is written anew when the daemon starts, its history by "
                 "atlas verify --repair")};
}

class SessionsCommand : public Command {
 public:
  std::string Name() const override { return "sessions"; }
  std::string Summary() const override { return "The sessions that were uploaded"; }
  void Declare(ArgumentSet&) override {}

  Status Run(CommandContext& context) override {
    Result<AtlasClient> client = context.Connect();
    if (!client) return client.error();
    const auto sessions = client->ListSessions();
    if (!sessions) return sessions.error();
    if (!context.is_json) {
      PrintSessions(*sessions, context.out);
      return DamageOf(*sessions);
    }
    boost::json::array array;
    for (const SessionSummary& session : *sessions) {
      array.push_back(SessionJson(session));
    }
    context.PrintJson({{"sessions", std::move(array)}});
    return DamageOf(*sessions);
  }
};

}  // namespace

std::unique_ptr<Command> MakeSessionsCommand() {
  return std::make_unique<SessionsCommand>();
}

}  // namespace atlas
