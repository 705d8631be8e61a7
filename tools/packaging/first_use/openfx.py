"""First use of the OpenFX bundle: describes every effect and renders a moving edge by Motion Blur, in a host of a few
lines. Usage: openfx.py POSTCHAIN.OFX [MESSAGE]
MESSAGE: the render must fail instead, with a message on the node that contains these words."""
import ctypes
import sys

OK, FAILED, UNKNOWN = 0, 1, 3
WIDTH, HEIGHT = 64, 36
P, S, D, I = ctypes.c_void_p, ctypes.c_char_p, ctypes.c_double, ctypes.c_int
objects = {}  # by handle: what the plugin sees as pointers
keep = []     # what must outlive the calls


def handle_of(value):
    objects[id(value)] = value
    return id(value)


class Object:
    def __init__(self, **properties):
        self.properties = {name: value if isinstance(value, list) else [value] for name, value in properties.items()}
        self.parameters, self.clips, self.order = {}, {}, []


def setter(handle, name, index, value):
    values = objects[handle].properties.setdefault(name.decode(), [])
    values[index:index + 1] = [value]
    return OK


def getter(handle, name, index, to):
    values = objects[handle].properties.get(name.decode(), [])
    if index >= len(values) or values[index] is None:
        return UNKNOWN
    to[0] = values[index]
    return OK


def suite(*functions):
    keep.extend(functions)
    table = (P * len(functions))(*(ctypes.cast(one, P) for one in functions))
    keep.append(table)
    return ctypes.addressof(table)


def function(*types):
    return lambda call: ctypes.CFUNCTYPE(I, *types)(call)


def pointer(to, value):
    if to:
        to[0] = handle_of(value)
    return OK


def unused(*_):
    sys.exit("a function was called that this host does not have")


UNUSED = function(P)(unused)
PP, SETS = ctypes.POINTER(P), [function(P, S, I, t)(setter) for t in (P, S, D, I)]
GETS = [function(P, S, I, ctypes.POINTER(t))(getter) for t in (P, S, D, I)]
properties = suite(*SETS, *[UNUSED] * 4, *GETS, *[UNUSED] * 6)


def define_parameter(owner, kind, name, to):
    effect = objects[owner]
    effect.parameters[name.decode()] = parameter = Object(kind=kind)
    return pointer(to, parameter)


def get_parameter(owner, name, to, to_properties):
    found = objects[owner].parameters.get(name.decode())
    return UNKNOWN if found is None else pointer(to, found) or pointer(to_properties, found)


def get_value(handle, _, first, second):
    values = objects[handle].properties.get("OfxParamPropDefault", [b""])
    kind = objects[handle].properties["kind"][0]
    if kind == b"OfxParamTypeString":
        ctypes.cast(first, ctypes.POINTER(S))[0] = values[0]
    elif b"Double" in kind:
        for to, value in zip((first, second), values):
            ctypes.cast(to, ctypes.POINTER(D))[0] = value
    else:
        ctypes.cast(first, ctypes.POINTER(I))[0] = values[0]
    return OK


# Variadic functions take pointers as others do, on x86-64.
parameters = suite(function(P, S, S, PP)(define_parameter), function(P, S, PP, PP)(get_parameter), UNUSED, UNUSED,
                   UNUSED, function(P, D, P, P)(get_value), UNUSED, UNUSED, function(P, S)(lambda *_: OK))


def define_clip(effect, name, to):
    clip = Object(OfxImageClipPropConnected=0)
    objects[effect].clips[name.decode()] = clip
    return pointer(to, clip)


def get_clip(effect, name, to, to_properties):
    clip = objects[effect].clips.get(name.decode())
    return UNKNOWN if clip is None else pointer(to, clip) or pointer(to_properties, clip)


def get_image(clip, _time, _region, to):
    pixels = getattr(objects[clip], "pixels", None)
    if pixels is None:
        return FAILED
    return pointer(to, Object(OfxImagePropData=ctypes.addressof(pixels), OfxImagePropRowBytes=WIDTH * 16,
                              OfxImagePropBounds=[0, 0, WIDTH, HEIGHT], OfxImageEffectPropPixelDepth=b"OfxBitDepthFloat",
                              OfxImageEffectPropComponents=b"OfxImageComponentRGBA",
                              OfxImageEffectPropPreMultiplication=b"OfxImageAlphaPremultiplied"))


def get_region(_clip, _time, to):
    for index, value in enumerate((0, 0, WIDTH, HEIGHT)):
        to[index] = value
    return OK


effects = suite(function(P, PP)(lambda effect, to: pointer(to, objects[effect])),
                function(P, PP)(lambda effect, to: pointer(to, objects[effect])),
                function(P, S, PP)(define_clip), function(P, S, PP, PP)(get_clip), UNUSED,
                function(P, D, P, PP)(get_image), function(P)(lambda _: OK),
                function(P, D, ctypes.POINTER(D))(get_region), function(P)(lambda _: 0))


shown = []  # messages on the node


def show(_effect, _kind, _id, _format, text):
    shown.append(text.decode())
    return OK


messages = suite(UNUSED, function(P, S, S, S, S)(show), function(P)(lambda _: OK))
SUITES = {b"OfxPropertySuite": properties, b"OfxImageEffectSuite": effects, b"OfxParameterSuite": parameters,
          b"OfxMessageSuite": messages}
fetch = ctypes.CFUNCTYPE(P, P, S, I)(lambda _host, name, _version: SUITES.get(name))
host = (P * 2)(handle_of(Object()), ctypes.cast(fetch, P))


class Plugin(ctypes.Structure):
    _fields_ = [("api", S), ("api_version", I), ("identifier", S), ("major", ctypes.c_uint), ("minor", ctypes.c_uint),
                ("set_host", ctypes.CFUNCTYPE(None, P)), ("main", ctypes.CFUNCTYPE(I, S, P, P, P))]


def act(plugin, action, effect=None, expected=OK, **arguments):
    in_arguments = handle_of(Object(**arguments)) if arguments else None
    status = plugin.main(action, handle_of(effect) if effect else None, in_arguments, handle_of(Object()))
    assert status == expected, (plugin.identifier, action, status, shown)


library = ctypes.CDLL(sys.argv[1])
library.OfxGetPlugin.restype = ctypes.POINTER(Plugin)
effect = None
for index in range(library.OfxGetNumberOfPlugins()):
    plugin = library.OfxGetPlugin(index).contents
    plugin.set_host(ctypes.addressof(host))
    act(plugin, b"OfxActionLoad")
    described = Object()
    act(plugin, b"OfxActionDescribe", described)
    act(plugin, b"OfxImageEffectActionDescribeInContext", described,
        OfxImageEffectPropContext=b"OfxImageEffectContextGeneral")
    print(plugin.identifier.decode(), len(described.clips), "clips", len(described.parameters), "parameters")
    if plugin.identifier == b"postchain.motion_blur":
        blur, effect = plugin, described


def image(pixel):
    return (ctypes.c_float * (WIDTH * HEIGHT * 4))(*(value for _ in range(HEIGHT) for x in range(WIDTH)
                                                   for value in pixel(x)))


for name, pixels in (("Source", image(lambda x: (float(x < 32),) * 3 + (1.0,))), ("Depth", image(lambda _: (5.0,) * 4)),
                     ("Motion", image(lambda _: (16.0, 0.0, 0.0, 0.0))), ("Output", image(lambda _: (-1.0,) * 4))):
    effect.clips[name].pixels = pixels
    effect.clips[name].properties["OfxImageClipPropConnected"] = [1]
effect.properties["OfxImageEffectPropProjectSize"] = [float(WIDTH), float(HEIGHT)]
act(blur, b"OfxActionCreateInstance", effect)
act(blur, b"OfxImageEffectActionRender", effect, FAILED if sys.argv[2:] else OK, OfxPropTime=1.0,
    OfxImageEffectPropRenderScale=[1.0, 1.0], OfxImageEffectPropRenderWindow=[0, 0, WIDTH, HEIGHT])
act(blur, b"OfxActionDestroyInstance", effect)
row = list(effect.clips["Output"].pixels)[HEIGHT // 2 * WIDTH * 4::4][:WIDTH]
if sys.argv[2:]:
    assert len(shown) == 1 and sys.argv[2] in shown[0] and set(row) == {-1}, (shown, row)
    print("message on the node:", shown[0])
    sys.exit()
assert not shown and row[20] == 1 and row[44] == 0 and 0.2 < row[31] < 0.8, row
print("rendered; the edge:", *(f"{value:.2f}" for value in row[27:37]))
