#include "server/operations_port.h"

#include <chrono>
#include <cstddef>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "core/base/str_cat.h"
#include "server/http/liveness.h"
#include "server/http/metrics_text.h"
#include "server/http/readiness.h"
#include "server/service/process_memory.h"

namespace atlas {
namespace {

constexpr std::chrono::milliseconds kPatience{1'000};  // for an answer of a thread

HttpReply ReplyFor(const Status& status) {
  HttpReply reply;
  reply.status = status.ok() ? 200 : 503;
  reply.body = (status.ok() ? "ok" : status.message()) + "\n";
  return reply;
}

std::vector<Pulse> PulsesOf(AtlasStore& store, TcpServer& server) {
  std::vector<Pulse> pulses;
  pulses.push_back({"the store's writer", [&store](const std::function<void()>& answer) {
                      store.Probe(AtlasStore::ProbeDepth::kQueue,
                                  [answer](const Result<bool>& /*result*/) { answer(); });
                    }});
  for (std::size_t i = 0; i < server.threads(); ++i) {
    pulses.push_back({StrCat("network thread ", i), [&server, i](std::function<void()> answer) {
                        server.Probe(i, std::move(answer));
                      }});
  }
  return pulses;
}

HttpPage HealthPage(AtlasStore& store, TcpServer& server) {
  const auto liveness = std::make_shared<Liveness>(PulsesOf(store, server), kPatience);
  return {"/healthz", [liveness] {
            return ReplyFor(liveness->Check());
          }};
}

HttpPage ReadyPage(AtlasService& service, AtlasStore& store) {
  const auto readiness = std::make_shared<Readiness>(service, store);
  return {"/readyz", [readiness] {
            return ReplyFor(readiness->Check());
          }};
}

HttpPage MetricsPage(AtlasService& service, AtlasStore& store, TcpServer& server) {
  return {"/metrics", [&service, &store, &server] {
            DaemonFigures figures;
            if (const Result<ServiceStatus> status = service.ReadStatus(); status) {
              figures.atlas = *status;
            }
            figures.net = server.ReadFigures();
            figures.writes = store.ReadWriteFigures();
            figures.room = store.ReadRoom();
            figures.rss_bytes = ResidentBytes();
            return HttpReply{200, kMetricsContentType, MetricsText(figures)};
          }};
}

}  // namespace

OperationsPort::OperationsPort(AtlasService& service,
                               AtlasStore& store,
                               TcpServer& server,
                               ListenSocket socket,
                               const HttpOptions& options)
    : http_(std::move(socket),
            {HealthPage(store, server), ReadyPage(service, store),
             MetricsPage(service, store, server)},
            options) {}

}  // namespace atlas
