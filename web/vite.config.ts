import { svelte } from '@sveltejs/vite-plugin-svelte'
import type { Plugin } from 'vite'
import { defineConfig } from 'vitest/config'

/** What the first script imports is fetched beside it, and its styles before it: on a slow line each round counts. */
const beside: Plugin = {
  name: 'beside',
  transformIndexHtml: {
    order: 'post',
    handler(_, { bundle }) {
      const files = Object.values(bundle ?? {})
      const later = files.flatMap((file) => (file.type === 'chunk' && file.name === 'page' ? [file] : []))
      const link = (rel: string, name: string) => ({
        tag: 'link',
        attrs: { rel, crossorigin: true, href: `./${name}` },
        injectTo: 'head' as const,
      })
      return [
        ...later
          .flatMap(({ viteMetadata }) => [...(viteMetadata?.importedCss ?? [])])
          .map((css) => link('stylesheet', css)),
        ...later.map(({ fileName }) => link('modulepreload', fileName)),
      ]
    },
  },
}

// The page is served under any path prefix and under `Content-Security-Policy: default-src 'self'`:
// relative addresses, and no asset turned into a data: address.
export default defineConfig({
  base: './',
  plugins: [svelte(), beside],
  build: {
    assetsInlineLimit: 0,
    modulePreload: { polyfill: false },
    target: 'es2022',
    cssTarget: 'es2022',
    // Two files and one for styles are the first view: the script that opens the stream, and the page.
    rolldownOptions: {
      output: {
        codeSplitting: {
          groups: [
            { name: 'main', test: /src\/main\.ts$/, priority: 2 },
            { name: 'page', test: /src\/page\.ts$/, priority: 1 },
          ],
        },
      },
    },
  },
  // `BUSBAR_URL=http://127.0.0.1:8080 npm run dev`: the page from source, the data from a running gateway.
  server: { proxy: { '/api': process.env.BUSBAR_URL ?? 'http://127.0.0.1:8080' } },
  resolve: process.env.VITEST ? { conditions: ['browser'] } : {},
  test: {
    environment: 'happy-dom',
    include: ['src/**/*.test.ts'],
  },
})
