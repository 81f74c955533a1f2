// Starts the page: the stream opens before anything is drawn.
import { mount } from 'svelte'
import './app.css'
import App from './App.svelte'
import { Page } from './state/page.svelte'

const page = new Page()
page.start()

const target = document.getElementById('page')
if (target) mount(App, { target, props: { page } })
