// What every pixel looks like: water, light and fog for all programs, then one program for each kind of thing.
// Places are [north, east, down], in metres; so up is −z, and the surface is z = 0.

/** Light in water: what one sees in a direction, how far one sees, and the web of light that waves throw on things. */
const WATER = `#version 300 es
precision highp float;
uniform vec3 eye;
uniform float seconds;    // of the clock on the wall: waves move while the replay stands still, unless motion is unwanted
uniform float clearness;  // distance in which water swallows most of what is behind it
const vec3 DEEP = vec3(0.008, 0.075, 0.14), MIDDLE = vec3(0.02, 0.27, 0.40), GLOW = vec3(0.47, 0.83, 0.86);
const vec3 ZENITH = vec3(0.30, 0.55, 0.82), HORIZON = vec3(0.86, 0.93, 0.96);
const vec3 SUN = normalize(vec3(0.35, -0.25, -0.9));

vec3 waterAlong(vec3 direction) {
  float up = -direction.z, sunny = max(dot(direction, SUN), 0.0);
  vec3 colour = mix(DEEP, MIDDLE, smoothstep(-0.9, 0.12, up));
  colour = mix(colour, GLOW, 0.75 * pow(smoothstep(-0.05, 1.0, up), 1.5));
  return colour + vec3(0.10, 0.16, 0.14) * pow(sunny, 5.0);
}

vec3 skyAlong(vec3 direction) {
  float up = max(-direction.z, 0.0);
  return mix(HORIZON, ZENITH, pow(up, 0.55)) + vec3(0.9, 0.8, 0.6) * pow(max(dot(direction, SUN), 0.0), 220.0);
}

float caustics(vec2 p) {
  vec2 q = p + 0.55 * vec2(sin(1.7 * p.y + seconds), sin(1.3 * p.x - 0.8 * seconds));
  float a = sin(2.1 * q.x + 0.7 * seconds) + sin(2.3 * q.y - 0.9 * seconds) + sin(1.6 * (q.x + q.y) + 0.5 * seconds);
  float ridge = 1.0 - abs(a) / 3.0;
  return ridge * ridge * ridge * ridge * ridge;
}

/** A colour at a place, behind the water between it and the eye. */
vec3 seenThroughWater(vec3 colour, vec3 place, float share) {
  vec3 way = place - eye;
  float total = length(way), wet = total;
  if (eye.z < 0.0) wet *= clamp(place.z / (place.z - eye.z), 0.0, 1.0);
  float lost = share * (1.0 - exp(-wet / clearness));
  vec3 behind = eye.z < 0.0 ? vec3(0.03, 0.27, 0.38) : waterAlong(way / total);
  return place.z < 0.0 && eye.z < 0.0 ? colour : mix(colour, behind, lost);
}
`;

/** All that is seen where nothing is: sky above, water below. It changes slowly over the picture, so that it is
    computed at the corners of tiles only: a machine without a graphics card is thankful. */
export const background = {
  vertex: WATER + `
uniform mat4 toWorld;
uniform vec2 tiles;
out vec3 colour;
void main() {
  int tile = gl_VertexID / 6, corner = int[6](0, 1, 2, 2, 1, 3)[gl_VertexID % 6], across = int(tiles.x);
  vec2 at = vec2(tile % across + (corner & 1), tile / across + (corner >> 1)) / tiles * 2.0 - 1.0;
  gl_Position = vec4(at, 0.0, 1.0);
  vec4 far = toWorld * vec4(at, 1.0, 1.0);
  vec3 direction = normalize(far.xyz / far.w - eye);
  if (eye.z < 0.0) {
    colour = -direction.z > 0.0 ? skyAlong(direction) : mix(HORIZON * 0.8, MIDDLE, smoothstep(0.0, 0.35, direction.z));
    return;
  }
  float shafts = sin(direction.x * 23.0 + 0.25 * seconds) * sin(direction.y * 17.0 - 0.2 * seconds);
  colour = waterAlong(direction) * (1.0 + 0.07 * shafts * smoothstep(-0.2, 0.6, -direction.z));
}`,
  fragment: `#version 300 es
precision mediump float;
in vec3 colour;
out vec4 pixel;
void main() {
  pixel = vec4(colour, 1.0);
}`,
};

/** Solid things, lit from above; ghosts have one colour and let the light through. */
export const solid = {
  vertex: `#version 300 es
layout(location = 0) in vec3 corner;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec3 colour;
uniform mat4 toClip, toEarth;
out vec3 place, upright, paint;
void main() {
  vec4 at = toEarth * vec4(corner, 1.0);
  place = at.xyz;
  upright = mat3(toEarth) * normal;
  paint = colour;
  gl_Position = toClip * at;
}`,
  fragment: WATER + `
in vec3 place, upright, paint;
uniform vec4 tint;        // colour of a ghost, and how much it hides; below zero: the paint as it is
out vec4 pixel;
void main() {
  vec3 n = normalize(upright), look = normalize(eye - place);
  if (dot(n, look) < 0.0) n = -n;
  float light = max(dot(n, SUN), 0.0), sky = 0.5 - 0.5 * n.z, rim = pow(1.0 - max(dot(n, look), 0.0), 3.0);
  float web = place.z > 0.0 ? caustics(place.xy * 3.0 + n.xy) * max(-n.z, 0.0) : 0.0;
  vec3 base = tint.a < 0.0 ? paint : tint.rgb;
  vec3 shade = base * (0.30 + 0.34 * sky + 0.55 * light) + base * web * 0.55;
  shade += vec3(0.55, 0.75, 0.8) * (0.35 * rim + 0.5 * pow(max(dot(reflect(-SUN, n), look), 0.0), 40.0));
  float alpha = tint.a < 0.0 ? 1.0 : tint.a + (1.0 - tint.a) * rim;
  pixel = vec4(seenThroughWater(shade, place, 0.8), alpha);
}`,
};

/** A line that is so many pixels wide wherever it runs: one instance is one piece of it. */
export const line = {
  vertex: `#version 300 es
layout(location = 0) in vec4 start;   // place, and the value at it
layout(location = 1) in vec4 end;
uniform mat4 toClip;
uniform vec2 screen;      // pixels
uniform float width;      // pixels
uniform float nearest;    // a piece that crosses this plane in front of the eye is cut at it
out float side, value, reached;
out vec3 place;
void main() {
  float atEnd = float(gl_VertexID >> 1);
  vec4 a = toClip * vec4(start.xyz, 1.0), b = toClip * vec4(end.xyz, 1.0);
  if (a.w < nearest && b.w > nearest) a = mix(a, b, (nearest - a.w) / (b.w - a.w));
  else if (b.w < nearest && a.w > nearest) b = mix(b, a, (nearest - b.w) / (a.w - b.w));
  vec4 here = atEnd < 0.5 ? a : b;
  vec2 way = (b.xy / b.w - a.xy / a.w) * screen;
  vec2 across = length(way) > 1e-4 ? normalize(vec2(-way.y, way.x)) : vec2(0.0, 1.0);
  side = float(gl_VertexID & 1) * 2.0 - 1.0;
  value = mix(start.w, end.w, atEnd);
  reached = value;
  place = mix(start.xyz, end.xyz, atEnd);
  here.xy += across * side * (width + 1.5) / screen * here.w;
  gl_Position = a.w < nearest && b.w < nearest ? vec4(2.0, 2.0, 2.0, 1.0) : here;
}`,
  fragment: WATER + `
in float side, value, reached;
in vec3 place;
uniform vec4 colour;      // of a track; alpha below zero: the value is a tension, shown by colour
uniform float highest;    // tension
uniform float dash;       // length of a dash and of a gap, in the unit of the value; 0: solid
uniform float width;
uniform float opacity;
out vec4 pixel;
vec3 tensionColour(float share) {
  share = clamp(share, 0.0, 1.0);
  vec3 low = vec3(1.0, 0.98, 0.80), middle = vec3(1.0, 0.72, 0.20), high = vec3(0.95, 0.28, 0.13), top = vec3(0.78, 0.02, 0.28);
  if (share < 0.33) return mix(low, middle, share / 0.33);
  return share < 0.7 ? mix(middle, high, (share - 0.33) / 0.37) : mix(high, top, (share - 0.7) / 0.3);
}
void main() {
  float edge = abs(side) * (width + 1.5), inside = clamp((width + 0.75 - edge) / 1.5, 0.0, 1.0);
  if (dash > 0.0 && fract(reached / (2.0 * dash)) > 0.5) discard;
  vec3 paint = colour.a < 0.0 ? tensionColour(value / highest) : colour.rgb;
  if (colour.a < 0.0) paint *= 0.80 + 0.28 * sqrt(max(1.0 - side * side, 0.0));
  pixel = vec4(seenThroughWater(paint, place, 0.35), inside * opacity * (colour.a < 0.0 ? 1.0 : colour.a));
}`,
};

/** A level plane around the eye: the bed, or a grid that stands for it. */
export const ground = {
  vertex: `#version 300 es
uniform mat4 toClip;
uniform vec3 middle;
uniform float reach;
out vec3 place;
void main() {
  vec2 corner = vec2(gl_VertexID & 1, gl_VertexID >> 1) * 2.0 - 1.0;
  place = middle + vec3(corner * reach, 0.0);
  gl_Position = toClip * vec4(place, 1.0);
}`,
  fragment: WATER + `
in vec3 place;
uniform float spacing;
uniform bool isBed;
out vec4 pixel;
/** How much of a pixel lies on lines between squares of side 1; none where squares are finer than pixels. */
float gridLines(vec2 q, vec2 grain, float thick) {
  vec2 lines = clamp(thick + 0.5 - abs(fract(q - 0.5) - 0.5) / grain, 0.0, 1.0) * clamp(1.4 - 2.4 * grain, 0.0, 1.0);
  return max(lines.x, lines.y);
}
void main() {
  vec2 q = place.xy / spacing, grain = fwidth(q);
  float lines = max(0.45 * gridLines(q, grain, 0.5), 0.9 * gridLines(0.2 * q, 0.2 * grain, 0.9));
  vec3 way = (place - eye) / clearness;
  if (isBed) {
    float rough = sin(place.x * 1.1 + 1.7 * sin(place.y * 0.37)) * sin(place.y * 0.9 + 1.3 * sin(place.x * 0.23));
    float web = caustics(place.xy * (0.9 / max(spacing, 0.5))) * exp(-place.z / 30.0);
    vec3 sand = vec3(0.50, 0.46, 0.35) * (0.62 + 0.06 * rough + 0.5 * web) * (0.35 + 0.65 * exp(-place.z / 40.0));
    pixel = vec4(seenThroughWater(mix(sand, vec3(0.75, 0.86, 0.86), 0.40 * lines), place, 1.0), 1.0);
    return;
  }
  float fade = 1.0 / (1.0 + 0.35 * dot(way, way));
  pixel = vec4(vec3(0.62, 0.86, 0.92), 0.5 * lines * fade * fade);
}`,
};

/** The surface, from above and from below. */
export const surface = {
  vertex: ground.vertex,
  fragment: WATER + `
in vec3 place;
uniform float waveLength;
out vec4 pixel;
vec2 ripples(vec2 p) {
  vec2 q = 6.3 * p / waveLength + 0.6 * sin(1.7 * p.yx / waveLength + vec2(0.4, 0.7) * seconds);
  vec3 phase = vec3(dot(q, vec2(0.8, 0.6)), dot(q, vec2(-0.77, 1.32)), dot(q, vec2(2.65, -0.54)));
  vec3 wave = cos(phase + vec3(1.1, 1.6, -2.2) * seconds);
  return vec2(0.8, 0.6) * wave.x + vec2(-0.4, 0.69) * wave.y + vec2(0.59, -0.12) * wave.z;
}
void main() {
  vec3 way = place - eye;
  float far = length(way), calm = exp(-far / (60.0 * waveLength));
  vec3 look = way / far;
  vec2 slope = ripples(place.xy) * calm;
  if (eye.z < 0.0) {
    vec3 n = normalize(vec3(0.05 * slope, -1.0));
    float facing = max(dot(-look, n), 0.0), grazing = 1.0 - facing, mirror = 0.03 + 0.97 * grazing * grazing * grazing * grazing * grazing;
    vec3 away = reflect(look, n), sky = mix(HORIZON, ZENITH, sqrt(max(-away.z, 0.0)));
    float sunny = max(dot(away, SUN), 0.0), glitter = pow(sunny, 90.0), haze = 1.0 - exp(-far / (14.0 * clearness));
    vec3 body = mix(vec3(0.04, 0.33, 0.44), vec3(0.02, 0.20, 0.32), facing);
    vec3 colour = mix(mix(body, sky, mirror) + glitter * 0.9, HORIZON * 0.93, haze * 0.8);
    pixel = vec4(colour, clamp(0.24 + 0.75 * mirror + glitter + haze, 0.0, 1.0));
    return;
  }
  // From below: bright straight above, where the sky shows (Snell's window, 49 degrees wide), a mirror of the deep beyond.
  vec2 tilt = 0.45 * slope;
  float window = smoothstep(0.45, 0.95, -look.z + 0.8 * dot(tilt, look.xy) + 0.25 * tilt.x);
  float crest = 0.5 + 0.5 * sin(5.0 * (tilt.x - 0.7 * tilt.y));
  crest *= crest * crest;
  vec3 mirrored = mix(MIDDLE * 1.15, GLOW * 0.72, 0.35 + 0.4 * crest);
  vec3 light = mix(mirrored, vec3(0.84, 0.97, 0.97), window) + 0.16 * crest * window;
  float fade = exp(-far / (1.2 * clearness));
  pixel = vec4(light, fade * (0.55 + 0.3 * crest + 0.15 * window));
}`,
};

/** What drifts in the water, so that one sees how fast one moves. */
export const specks = {
  vertex: `#version 300 es
layout(location = 0) in vec3 seed;    // anywhere in a box of side 1
uniform mat4 toClip;
uniform vec3 middle;      // the box stands around this place, and what leaves it on one side comes in on the other
uniform float side;
uniform float pixels;
out float strength;
void main() {
  vec3 place = (fract(seed - middle / side + 0.5) - 0.5) * side + middle;
  gl_Position = toClip * vec4(place, 1.0);
  gl_PointSize = clamp(pixels * side * 0.012 / gl_Position.w, 1.0, 5.0);
  vec3 off = abs(place - middle) / (0.5 * side);
  strength = (1.0 - smoothstep(0.6, 1.0, max(off.x, max(off.y, off.z)))) * step(0.02, place.z);
}`,
  fragment: `#version 300 es
precision mediump float;
in float strength;
out vec4 pixel;
void main() {
  vec2 at = gl_PointCoord * 2.0 - 1.0;
  pixel = vec4(0.85, 0.95, 0.95, 0.45 * strength * (1.0 - smoothstep(0.2, 1.0, dot(at, at))));
}`,
};
