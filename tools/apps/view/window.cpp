#include "tools/apps/view/window.h"

#include <backends/imgui_impl_glfw.h>
#include <backends/imgui_impl_opengl3.h>
#include <epoxy/gl.h>
#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>

#include <algorithm>
#include <cmath>

#include "config/chain_file.h"
#include "tools/apps/view/save.h"
#include "tools/apps/view/ui.h"
#include "tools/sequence/files/json.h"

namespace postchain::view {
namespace {

constexpr float kFontPx = 13;         // of ImGui's built-in font, whose pixels are then sharp
constexpr int kFramesAfterEvent = 3;  // until ImGui has settled hovers and new windows
constexpr double kIdleS = 0.25, kBusyS = 0.03;
constexpr auto kStateInterval = std::chrono::milliseconds(100);

std::string g_glfw_error;

// GLFW, for as long as this lives.
class Library {
  public:
    Library() {
        glfwSetErrorCallback([](int, const char* text) { g_glfw_error = text; });
        ok_ = glfwInit() == GLFW_TRUE;
    }
    ~Library() { glfwTerminate(); }
    bool ok() const { return ok_; }

  private:
    bool ok_ = false;
};

Status no_window(const std::string& why) {
    return Status(StatusCode::gl,
                  concat("no window can be opened (", why,
                         "); set DISPLAY or WAYLAND_DISPLAY (over ssh: ssh -X), or use the page "
                         "of postchain serve, which needs only a browser"));
}

struct Window {
    GLFWwindow* handle = nullptr;
    ~Window() {
        if (handle) glfwDestroyWindow(handle);
    }
};

// EGL is what the filter's context uses; GLX where a window cannot have it.
GLFWwindow* make_window(const std::array<int, 2>& size) {
    for (const int api : {GLFW_EGL_CONTEXT_API, GLFW_NATIVE_CONTEXT_API}) {
        glfwDefaultWindowHints();
        glfwWindowHint(GLFW_CONTEXT_CREATION_API, api);
        glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 3);
        glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 3);
        glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
        glfwWindowHint(GLFW_SCALE_TO_MONITOR, GLFW_TRUE);
        if (GLFWwindow* window =
                glfwCreateWindow(size[0], size[1], "postchain view", nullptr, nullptr))
            return window;
    }
    return nullptr;
}

class Interface {
  public:
    explicit Interface(GLFWwindow* window) {
        ImGui::CreateContext();
        ImGui::GetIO().IniFilename = nullptr;  // nothing is written
        ImGui_ImplGlfw_InitForOpenGL(window, true);
        ImGui_ImplOpenGL3_Init("#version 330");
    }
    ~Interface() {
        ImGui_ImplOpenGL3_Shutdown();
        ImGui_ImplGlfw_Shutdown();
        ImGui::DestroyContext();
    }
    void set_scale(float scale) {
        if (scale == scale_) return;
        scale_ = scale;
        ImGuiStyle style;
        ImGui::StyleColorsDark(&style);
        style.Colors[ImGuiCol_WindowBg] = {0.09f, 0.09f, 0.10f, 1};
        style.Colors[ImGuiCol_TextDisabled] = {0.68f, 0.68f, 0.70f, 1};
        style.Colors[ImGuiCol_PopupBg] = {0.12f, 0.12f, 0.14f, 1};
        style.WindowRounding = 0;
        style.ScaleAllSizes(scale);
        ImGui::GetStyle() = style;
        ImFontConfig font;
        font.SizePixels = std::round(kFontPx * scale);
        ImGui::GetIO().Fonts->Clear();
        ImGui::GetIO().Fonts->AddFontDefault(&font);
        ImGui_ImplOpenGL3_DestroyFontsTexture();
        ImGui_ImplOpenGL3_CreateFontsTexture();
    }
    float scale() const { return scale_; }

  private:
    float scale_ = 0;
};

// Input as far as a frame has drawn it.
struct DrawnInput {
    int presses = 0;                               // keys and buttons that went down or up
    std::array<float, 2> mouse = {}, window = {};  // place in the window, its size
    bool settled = false;                          // the session knows of it
};

io::Json times_json(const std::deque<double>& times) {
    std::vector<double> sorted(times.begin(), times.end());
    std::sort(sorted.begin(), sorted.end());
    if (sorted.empty()) return io::Json::object();
    return {{"count", sorted.size()},
            {"median_ms", sorted[sorted.size() / 2]},
            {"p95_ms", sorted[(sorted.size() * 95 + 99) / 100 - 1]},
            {"max_ms", sorted.back()},
            {"last_ms", times.back()}};
}

// The viewer's state as JSON, for programs that drive it.
std::string state_json(const Session& session, const Ui& ui, const DrawnInput& input) {
    io::Json json;
    json["at_rest"] = session.at_rest() && input.settled;
    json["presses"] = input.presses;
    json["mouse"] = input.mouse;
    json["window"] = input.window;
    json["frame"] = session.frame();
    json["playing"] = session.playing() != 0;
    json["frames_played"] = session.frames_played();
    json["frames"] = session.frames();
    json["chain"] = write_chain(session.document().chain_to_save());
    json["changed"] = session.document().changed();
    json["focus_keys"] = io::Json::object();
    for (const auto& [frame, distance] : session.document().state().focus_keys)
        json["focus_keys"][std::to_string(frame)] = distance;
    json["view"] = session.view().plane;
    json["compare"] = int(session.view().compare);
    json["draft"] = session.shown().draft;
    json["filter_ms"] = session.shown().milliseconds;
    json["trouble"] = session.trouble();
    json["messages"] = io::Json::array();
    for (const Message& message : session.messages()) json["messages"].push_back(message.text);
    json["metrics"] = io::Json::object();
    for (const auto& [name, value] : session.painted().metrics)
        json["metrics"][name] = value ? io::Json(*value) : io::Json();
    json["textures_alive"] = session.shown().counters.textures_alive;
    json["texture_allocations"] = session.shown().counters.texture_allocations;
    json["export"] = {{"running", ui.exporter().state().running},
                      {"text", ui.exporter().state().text}};
    json["zoom"] = ui.port().zoom();
    json["pixel_0_0"] = ui.port().to_screen({0, 0});
    json["interface"] = times_json(ui.interface_ms());
    json["draft_latency"] = times_json(session.latencies().draft);
    json["refined_latency"] = times_json(session.latencies().refined);
    for (const auto& [name, place] : ui.context().places) json["places"][name] = place;
    return io::json_text(json, 1) + "\n";
}

class Loop {
  public:
    Loop(GLFWwindow* window, Session& session, const WindowSettings& settings)
        : window_(window),
          settings_(settings),
          session_(session),
          interface_(window),
          ui_(session, [] { glfwPostEmptyEvent(); }) {}

    Status run(const std::atomic<bool>& stop) {
        while (!ui_.wants_to_close() && !stop) {
            const bool busy = !session_.at_rest() || draw_ > 0;
            glfwWaitEventsTimeout(draw_ > 0 ? 0.001 : busy ? kBusyS : kIdleS);
            if (glfwWindowShouldClose(window_)) {
                glfwSetWindowShouldClose(window_, GLFW_FALSE);
                ui_.ask_to_close();
                draw_ = kFramesAfterEvent;
            }
            const auto start = Clock::now();
            if (session_.tick(start) || g_events) draw_ = kFramesAfterEvent;
            g_events = false;
            if (draw_ > 0) {
                --draw_;
                draw();
                const std::chrono::duration<double, std::milli> taken = Clock::now() - start;
                ui_.add_interface_ms(taken.count());
            }
            RETURN_IF_ERROR(write_state());
        }
        return Status();
    }

    // Set by GLFW's callbacks.
    static inline bool g_events = true;
    static void note_press(int action) {
        g_events = true;
        if (action != GLFW_REPEAT) ++g_presses;
    }

  private:
    void draw() {
        int width = 0, height = 0;
        glfwGetFramebufferSize(window_, &width, &height);
        float scale = float(settings_.ui_scale);
        if (scale <= 0) {
            float across = 1;
            glfwGetWindowContentScale(window_, &scale, &across);
        }
        interface_.set_scale(std::clamp(scale, 0.5f, 4.0f));
        if (ui_.upload()) draw_ = std::max(draw_, 1);
        ImGui_ImplOpenGL3_NewFrame();
        ImGui_ImplGlfw_NewFrame();
        ImGui::NewFrame();
        const ImVec2 size = ImGui::GetIO().DisplaySize;
        ui_.draw(size.x, size.y, interface_.scale());
        const ImVec2 mouse = ImGui::GetIO().MousePos;
        drawn_ = {g_presses, {mouse.x, mouse.y}, {size.x, size.y}};
        ImGui::Render();
        glViewport(0, 0, width, height);
        glClearColor(0.05f, 0.05f, 0.055f, 1);
        glClear(GL_COLOR_BUFFER_BIT);
        ImGui_ImplOpenGL3_RenderDrawData(ImGui::GetDrawData());
        glfwSwapBuffers(window_);
    }

    Status write_state() {
        if (settings_.state_file.empty() || Clock::now() - written_ < kStateInterval)
            return Status();
        written_ = Clock::now();
        drawn_.settled = draw_ == 0;
        const std::string text = state_json(session_, ui_, drawn_);
        if (text == state_) return Status();
        state_ = text;
        return save_text(session_.settings().run, settings_.state_file, text, "the state file",
                         true);
    }

    GLFWwindow* window_;
    const WindowSettings& settings_;
    Session& session_;
    Interface interface_;
    Ui ui_;
    // Keys and buttons that went down or up.
    static inline int g_presses = 0;
    DrawnInput drawn_;
    int draw_ = kFramesAfterEvent;
    std::string state_;
    Clock::time_point written_;
};

// ImGui's own callbacks, which it installs, call these.
void note_events(GLFWwindow* window) {
    const auto event = [](GLFWwindow*, auto...) { Loop::g_events = true; };
    glfwSetWindowRefreshCallback(window, event);
    glfwSetFramebufferSizeCallback(window, event);
    glfwSetCursorPosCallback(window, event);
    glfwSetMouseButtonCallback(window,
                               [](GLFWwindow*, int, int action, int) { Loop::note_press(action); });
    glfwSetScrollCallback(window, event);
    glfwSetKeyCallback(window,
                       [](GLFWwindow*, int, int, int action, int) { Loop::note_press(action); });
    glfwSetCharCallback(window, event);
    glfwSetWindowFocusCallback(window, event);
}

}  // namespace

Status show_window(SessionSettings settings, const WindowSettings& window_settings,
                   const std::atomic<bool>& stop) {
    const Library library;
    if (!library.ok()) return no_window(g_glfw_error);
    auto session = Session::open(std::move(settings), [] { glfwPostEmptyEvent(); });
    if (!session.ok()) return session.status();
    Window window{make_window(window_settings.size)};
    if (!window.handle) return no_window(g_glfw_error);
    glfwMakeContextCurrent(window.handle);
    glfwSwapInterval(1);
    note_events(window.handle);
    return Loop(window.handle, **session, window_settings).run(stop);
}

}  // namespace postchain::view
