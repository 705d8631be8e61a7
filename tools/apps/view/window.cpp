#include "tools/apps/view/window.h"

#include <backends/imgui_impl_glfw.h>
#include <backends/imgui_impl_opengl3.h>
#include <epoxy/gl.h>
#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>

#include <algorithm>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "config/chain_file.h"
#include "tools/apps/view/save.h"
#include "tools/apps/view/ui.h"
#include "tools/sequence/files/json.h"

namespace postchain::view {
namespace {

constexpr float kFontPx = 16;
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

// Grays without a hue, beside which an image's colors are judged, and one muted accent.
void set_style(float scale) {
    ImGuiStyle style;
    ImGui::StyleColorsDark(&style);
    const auto gray = [](float value, float alpha = 1) {
        return ImVec4(value, value, value * 1.015f, alpha);
    };
    const auto accent = [](float brightness, float alpha = 1) {
        return ImVec4(0.40f * brightness, 0.55f * brightness, 0.70f * brightness, alpha);
    };
    const std::pair<ImGuiCol, ImVec4> colors[] = {
        {ImGuiCol_Text, gray(0.88f)},
        {ImGuiCol_TextDisabled, gray(0.62f)},
        {ImGuiCol_WindowBg, gray(0.15f)},
        {ImGuiCol_PopupBg, gray(0.19f)},
        {ImGuiCol_Border, gray(0.28f)},
        {ImGuiCol_FrameBg, gray(0.22f)},
        {ImGuiCol_FrameBgHovered, gray(0.27f)},
        {ImGuiCol_FrameBgActive, gray(0.30f)},
        {ImGuiCol_TitleBg, gray(0.19f)},
        {ImGuiCol_TitleBgActive, gray(0.22f)},
        {ImGuiCol_CheckMark, accent(1.2f)},
        {ImGuiCol_SliderGrab, accent(0.9f, 0.6f)},
        {ImGuiCol_SliderGrabActive, accent(1.1f, 0.7f)},
        {ImGuiCol_Button, gray(0.25f)},
        {ImGuiCol_ButtonHovered, gray(0.31f)},
        {ImGuiCol_ButtonActive, accent(0.8f)},
        {ImGuiCol_Header, gray(0.24f)},
        {ImGuiCol_HeaderHovered, gray(0.29f)},
        {ImGuiCol_HeaderActive, accent(0.7f)},
        {ImGuiCol_Separator, gray(0.25f)},
        {ImGuiCol_Tab, gray(0.17f)},
        {ImGuiCol_TabHovered, gray(0.29f)},
        {ImGuiCol_TabActive, gray(0.26f)},
        {ImGuiCol_PlotLines, accent(1)},
        {ImGuiCol_PlotHistogram, accent(0.75f)},
        {ImGuiCol_TextSelectedBg, accent(0.7f, 0.6f)},
        {ImGuiCol_ModalWindowDimBg, ImVec4(0, 0, 0, 0.45f)},
    };
    for (const auto& [index, color] : colors) style.Colors[index] = color;
    style.WindowRounding = 0;
    style.PopupRounding = style.FrameRounding = style.GrabRounding = style.TabRounding = 3;
    style.WindowBorderSize = 0;
    style.WindowPadding = {10, 8};
    style.FramePadding = {7, 3};
    style.ItemSpacing = {7, 5};
    style.ScrollbarSize = 12;
    style.GrabMinSize = 8;
    style.ScaleAllSizes(scale);
    ImGui::GetStyle() = style;
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
        set_style(scale);
        fonts_loaded_ = false;
    }
    // Before a frame; `letters` as UiContext has them.
    void set_fonts(const std::set<ImWchar>& letters, bool new_letters) {
        if (fonts_loaded_ && !new_letters) return;
        fonts_loaded_ = true;
        load_fonts(*ImGui::GetIO().Fonts, kFontPx * scale_, letters);
        ImGui_ImplOpenGL3_DestroyFontsTexture();
        ImGui_ImplOpenGL3_CreateFontsTexture();
    }
    void forget_fonts() { fonts_loaded_ = false; }
    float scale() const { return scale_; }

  private:
    float scale_ = 0;
    bool fonts_loaded_ = false;
};

// Input as far as a frame has drawn it.
struct DrawnInput {
    int presses = 0;                               // keys and buttons that went down or up
    std::array<float, 2> mouse = {}, window = {};  // place in the window, its size
    bool settled = false;                          // the session knows of it
    int frames_drawn = 0;
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
    json["frame"] = session.playback().frame();
    json["playing"] = session.playback().playing() != 0;
    json["frames_drawn"] = input.frames_drawn;
    json["asking"] = ui.is_asking();
    json["title"] = session.title();
    json["channel"] = int(session.view().channel);
    json["frames_played"] = session.playback().frames_played();
    json["frames"] = session.playback().frames();
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
    for (const auto& one : session.messages().list()) json["messages"].push_back(one.text);
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
    Loop(GLFWwindow* window, std::unique_ptr<Session> session, const SessionOpener& opener,
         const WindowSettings& settings)
        : window_(window),
          settings_(settings),
          opener_(opener),
          interface_(window),
          session_(std::move(session)),
          ui_(std::make_unique<Ui>(*session_, glfwPostEmptyEvent)) {}

    Status run(const std::atomic<bool>& stop) {
        while (!ui_->wants_to_close() && !stop) {
            const bool busy = !session_->at_rest() || draw_ > 0;
            glfwWaitEventsTimeout(draw_ > 0 ? 0.001 : busy ? kBusyS : kIdleS);
            if (glfwWindowShouldClose(window_)) {
                glfwSetWindowShouldClose(window_, GLFW_FALSE);
                ui_->ask_to_close();
                draw_ = kFramesAfterEvent;
            }
            take_drops();
            if (const auto request = ui_->take_request()) open(*request);
            const auto start = Clock::now();
            if (session_->tick(start) || g_events) draw_ = kFramesAfterEvent;
            g_events = false;
            show_title();
            if (draw_ > 0) {
                --draw_;
                draw();
                const std::chrono::duration<double, std::milli> taken = Clock::now() - start;
                ui_->add_interface_ms(taken.count());
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
    static void note_drop(int count, const char** paths) {
        g_events = true;
        g_dropped.assign(paths, paths + count);
    }

  private:
    void take_drops() {
        if (g_dropped.empty()) return;
        const auto request = request_for(std::exchange(g_dropped, {}));
        if (request.ok())
            ui_->open(*request);
        else
            session_->messages().say(request.status().message(), true);
    }

    // Edits of the chain stay if another chain is not what is opened.
    void open(const OpenRequest& request) {
        draw_ = kFramesAfterEvent;
        auto settings = opener_(request);
        if (!settings.ok()) return session_->messages().say(settings.status().message(), true);
        auto next = Session::open(std::move(*settings), glfwPostEmptyEvent);
        if (!next.ok()) return session_->messages().say(next.status().message(), true);
        const Document& document = session_->document();
        if (request.chain.empty() && document.unsaved())
            (*next)->document().restore(document.state().clone());
        session_->open_chain().discard_edits();
        (*next)->view().display = session_->view().display;
        if (request.input.empty()) (*next)->playback().go_to(session_->playback().frame());
        if (!request.truth.empty()) {
            (*next)->view().compare = Compare::wipe;
            (*next)->view().target = CompareTarget::truth;
        }
        ui_.reset();
        session_ = std::move(*next);
        ui_ = std::make_unique<Ui>(*session_, glfwPostEmptyEvent);
        interface_.forget_fonts();
    }

    void show_title() {
        const std::string title = session_->title() + "  -  postchain view";
        if (title == title_) return;
        title_ = title;
        glfwSetWindowTitle(window_, title.c_str());
    }

    void show_full_screen() {
        if (ui_->wants_full_screen() == (glfwGetWindowMonitor(window_) != nullptr)) return;
        if (!ui_->wants_full_screen())
            return glfwSetWindowMonitor(window_, nullptr, before_[0], before_[1], before_[2],
                                        before_[3], GLFW_DONT_CARE);
        GLFWmonitor* monitor = glfwGetPrimaryMonitor();
        const GLFWvidmode* mode = monitor ? glfwGetVideoMode(monitor) : nullptr;
        if (!mode) return;
        glfwGetWindowPos(window_, &before_[0], &before_[1]);
        glfwGetWindowSize(window_, &before_[2], &before_[3]);
        glfwSetWindowMonitor(window_, monitor, 0, 0, mode->width, mode->height, mode->refreshRate);
    }

    void draw() {
        show_full_screen();
        int width = 0, height = 0;
        glfwGetFramebufferSize(window_, &width, &height);
        float scale = float(settings_.ui_scale);
        if (scale <= 0) {
            float across = 1;
            glfwGetWindowContentScale(window_, &scale, &across);
        }
        interface_.set_scale(std::clamp(scale, 0.5f, 4.0f));
        interface_.set_fonts(ui_->context().letters,
                             std::exchange(ui_->context().new_letters, false));
        if (ui_->upload()) draw_ = std::max(draw_, 1);
        ImGui_ImplOpenGL3_NewFrame();
        ImGui_ImplGlfw_NewFrame();
        ImGui::NewFrame();
        const ImVec2 size = ImGui::GetIO().DisplaySize;
        ui_->draw(size.x, size.y, interface_.scale());
        const ImVec2 mouse = ImGui::GetIO().MousePos;
        drawn_ = {g_presses, {mouse.x, mouse.y}, {size.x, size.y}, false, drawn_.frames_drawn + 1};
        if (ui_->context().new_letters) draw_ = std::max(draw_, 2);
        ImGui::Render();
        glViewport(0, 0, width, height);
        glClearColor(0.09f, 0.09f, 0.09f, 1);
        glClear(GL_COLOR_BUFFER_BIT);
        ImGui_ImplOpenGL3_RenderDrawData(ImGui::GetDrawData());
        glfwSwapBuffers(window_);
    }

    Status write_state() {
        if (settings_.state_file.empty() || Clock::now() - written_ < kStateInterval)
            return Status();
        written_ = Clock::now();
        drawn_.settled = draw_ == 0;
        const std::string text = state_json(*session_, *ui_, drawn_);
        if (text == state_) return Status();
        state_ = text;
        return save_text(session_->settings().run, settings_.state_file, text, "the state file",
                         true);
    }

    GLFWwindow* window_;
    const WindowSettings& settings_;
    const SessionOpener& opener_;
    Interface interface_;
    std::unique_ptr<Session> session_;
    std::unique_ptr<Ui> ui_;
    std::string title_;
    std::array<int, 4> before_ = {};  // place and size of the window that is not full-screen
    // Keys and buttons that went down or up.
    static inline int g_presses = 0;
    static inline std::vector<std::string> g_dropped;
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
    glfwSetDropCallback(
        window, [](GLFWwindow*, int count, const char** paths) { Loop::note_drop(count, paths); });
}

}  // namespace

Status show_window(SessionSettings settings, const SessionOpener& opener,
                   const WindowSettings& window_settings, const std::atomic<bool>& stop) {
    const Library library;
    if (!library.ok()) return no_window(g_glfw_error);
    auto session = Session::open(std::move(settings), [] { glfwPostEmptyEvent(); });
    if (!session.ok()) return session.status();
    Window window{make_window(window_settings.size)};
    if (!window.handle) return no_window(g_glfw_error);
    glfwMakeContextCurrent(window.handle);
    glfwSwapInterval(1);
    note_events(window.handle);
    return Loop(window.handle, std::move(*session), opener, window_settings).run(stop);
}

}  // namespace postchain::view
