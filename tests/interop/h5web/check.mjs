// Opens a result file with H5Web in headless Chromium: its default plot is there without a click, drawn, under the right labels, and the console is quiet.
// Usage: node check.mjs RESULT.h5 CHROMIUM LABEL... [--screenshot FILE]: each LABEL is text that the plot must show.
import { build } from 'esbuild';
import { readFile } from 'node:fs/promises';
import { createServer } from 'node:http';
import { dirname } from 'node:path';
import { fileURLToPath } from 'node:url';
import puppeteer from 'puppeteer-core';

// a busy machine draws without a graphics card: ten times what it took when this was written
const PATIENCE_MS = 120_000;
const here = dirname(fileURLToPath(import.meta.url));
const [result, chromium, ...rest] = process.argv.slice(2);
const at = rest.indexOf('--screenshot');
const screenshot = at < 0 ? undefined : rest[at + 1];
const labels = at < 0 ? rest : rest.slice(0, at);

async function files() {
  const bundle = await build({
    entryPoints: [`${here}/page.jsx`],
    bundle: true,
    write: false,
    outdir: '/',
    format: 'esm',
    target: 'es2022',
    jsx: 'automatic',
    minify: true,
    define: { 'process.env.NODE_ENV': '"production"' },
    loader: { '.woff2': 'dataurl', '.woff': 'dataurl', '.svg': 'dataurl' },
    logLevel: 'error',
  });
  const output = Object.fromEntries(bundle.outputFiles.map((file) => [file.path, file.contents]));
  const page =
    '<!doctype html><meta charset="utf-8"><link rel="icon" href="data:,"><link rel="stylesheet" href="/page.css">' +
    '<div id="root" style="height: 100vh; display: flex"></div><script type="module" src="/page.js"></script>';
  return { '/': page, '/result.h5': await readFile(result), ...output };
}

function serve(contents) {
  const types = { css: 'text/css', js: 'text/javascript', h5: 'application/x-hdf5', '/': 'text/html' };
  const server = createServer((request, response) => {
    const body = contents[request.url];
    const type = types[request.url.split('.').at(-1)] ?? 'text/plain';
    response.writeHead(body ? 200 : 404, { 'content-type': type }).end(body ?? '');
  });
  return new Promise((resolve) => server.listen(0, '127.0.0.1', () => resolve(server)));
}

/** Share of the points of a PNG that are no shade of grey: a curve is coloured, axes and grid are not. */
const coloured = (page, png) =>
  page.evaluate(async (base64) => {
    const image = await createImageBitmap(await (await fetch(`data:image/png;base64,${base64}`)).blob());
    const canvas = new OffscreenCanvas(image.width, image.height);
    const context = canvas.getContext('2d');
    context.drawImage(image, 0, 0);
    const { data } = context.getImageData(0, 0, image.width, image.height);
    let count = 0;
    for (let i = 0; i < data.length; i += 4) {
      const [low, high] = [Math.min(data[i], data[i + 1], data[i + 2]), Math.max(data[i], data[i + 1], data[i + 2])];
      count += high - low > 80 ? 1 : 0;
    }
    return count / (data.length / 4);
  }, png);

const server = await serve(await files());
const browser = await puppeteer.launch({
  executablePath: chromium,
  args: ['--no-sandbox', '--use-angle=swiftshader', '--enable-unsafe-swiftshader', '--disable-dev-shm-usage'],
});
const problems = [];
try {
  const page = await browser.newPage();
  await page.setViewport({ width: 1200, height: 800 });
  // Chromium's own words on drawing without a graphics card are not the page's
  const driver = (text) => /GL Driver Message|swiftshader|GroupMarkerNotSet/i.test(text);
  page.on('console', (message) => {
    if (message.type() === 'error' && !driver(message.text())) problems.push(`console: ${message.text()}`);
  });
  page.on('pageerror', (error) => problems.push(`page: ${error.message}`));
  await page.goto(`http://127.0.0.1:${server.address().port}/`);
  const shown = () => document.querySelector('canvas') !== null && /NeXus|Line/.test(document.body.innerText);
  await page.waitForFunction(shown, { timeout: PATIENCE_MS }).catch(() => problems.push('no plot appeared'));
  // the canvas is drawn a frame later
  let share = 0;
  for (const end = Date.now() + PATIENCE_MS; share === 0 && Date.now() < end && problems.length === 0; ) {
    const canvas = await page.$('canvas');
    share = await coloured(page, await canvas.screenshot({ encoding: 'base64' }));
  }
  const text = await page.evaluate(() => document.body.innerText + document.body.innerHTML.replace(/<[^>]*>/g, '\n'));
  for (const label of labels) {
    if (!text.includes(label)) problems.push(`the plot does not say "${label}"`);
  }
  if (share === 0) problems.push('the plot is empty: nothing in its canvas has a colour');
  if (screenshot) await page.screenshot({ path: screenshot });
  console.log(`H5Web: default plot with ${labels.join(', ')}; ${(100 * share).toFixed(2)} % of its canvas is curve`);
  if (problems.length > 0) console.log(text.slice(0, 3000));
} finally {
  await browser.close();
  server.close();
}
for (const problem of problems) console.error(`FAILED H5Web: ${problem}`);
process.exit(problems.length > 0 ? 1 : 0);
